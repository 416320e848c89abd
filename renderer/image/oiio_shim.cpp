// SPDX-License-Identifier: MIT
// The one home of OpenImageIO (Debian's 2.4). Its formats read and write through an IOProxy, so
// that neither files nor memfds are needed but for deep images.
#include "renderer/image/oiio_shim.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

#include <OpenImageIO/deepdata.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace
{

// Library-wide settings, all of them constants. "threads" is not among them: setting it starts the
// very pool it limits, which the decoder's sandbox forbids. Readers and writers are set one by
// one.
void configure()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("exr_threads", -1);
        // OpenEXR's C interface takes a file that ends within its last block of lines (3.4).
        OIIO::attribute("openexr:core", 0);
        OIIO::attribute("limits:channels", int(IMAGE_CHANNELS_MAX));
        OIIO::attribute("limits:imagesize_MB", 4096);
    });
}

OIIO::TypeDesc type_of(enum image_component component)
{
    switch (component) {
    case IMAGE_U8:
        return OIIO::TypeDesc::UINT8;
    case IMAGE_U16:
        return OIIO::TypeDesc::UINT16;
    case IMAGE_U32:
        return OIIO::TypeDesc::UINT32;
    default:
        return OIIO::TypeDesc::FLOAT;
    }
}

std::string first_line(const std::string &text)
{
    return text.substr(0, text.find('\n'));
}

void name_channels(const struct image *image, OIIO::ImageSpec &spec)
{
    if (image->channels == 1)
        spec.channelnames = {"Y"};
    else if (image->channels == 2)
        spec.channelnames = {"Y", "A"};
    for (int i = 0; i < image->channels; i++)
        if (image->channel_names[i][0])
            spec.channelnames[size_t(i)] = image->channel_names[i];
    spec.alpha_channel = -1;
    for (int i = 0; i < image->channels; i++)
        if (spec.channelnames[size_t(i)] == "A")
            spec.alpha_channel = i;
}

void set_options(const oiio_option *options, OIIO::ImageSpec &spec)
{
    for (const oiio_option *o = options; o->name; o++) {
        if (o->text)
            spec.attribute(o->name, o->text);
        else
            spec.attribute(o->name, o->number);
    }
}

bool encode(const struct image *image, const char *format, const oiio_option *options, void **bytes,
            size_t *size_bytes, struct error *err)
{
    OIIO::ImageSpec spec(image->width_px, image->height_px, image->channels,
                         type_of(image->component));
    name_channels(image, spec);
    set_options(options, spec);
    std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
    if (!output || !output->supports("ioproxy"))
        return error_set(err, ERROR_UNSUPPORTED, "images cannot be written as %s here: %s", format,
                         first_line(OIIO::geterror()).c_str());
    std::vector<unsigned char> memory;
    OIIO::Filesystem::IOVecOutput proxy(memory);
    std::string name = std::string("memory.") + format;
    output->threads(1);
    output->set_ioproxy(&proxy);
    if (!output->open(name, spec) || !output->write_image(spec.format, image->pixels) ||
        !output->close())
        return error_set(err, ERROR_INTERNAL, "writing %s: %s", format,
                         first_line(output->geterror()).c_str());
    *bytes = malloc(memory.size() ? memory.size() : 1);
    if (!*bytes)
        return error_set(err, ERROR_NO_MEMORY, "%s of %zu bytes", format, memory.size());
    memcpy(*bytes, memory.data(), memory.size());
    *size_bytes = memory.size();
    return true;
}

// The channels of a deep sample, as the next function sets them.
const std::vector<std::string> DEEP_CHANNELS = {"R", "G", "B", "A", "AR", "AG", "AB", "Z", "ZBack"};

void set_deep_sample(OIIO::DeepData &data, int64_t pixel, int at, const deep_sample &sample)
{
    const float *o = sample.opacity, mean = (o[0] + o[1] + o[2]) / 3;
    const float values[] = {
        sample.color[0], sample.color[1], sample.color[2], mean, o[0], o[1], o[2],
        sample.depth,    sample.back};
    for (int c = 0; c < int(DEEP_CHANNELS.size()); c++)
        data.set_deep_value(pixel, c, at, values[c]);
}

// A row at a time, so that no second copy of all samples is needed.
bool write_deep(const deep_image *image, OIIO::ImageOutput &output)
{
    const OIIO::ImageSpec &spec = output.spec();
    const std::vector<OIIO::TypeDesc> types(DEEP_CHANNELS.size(), OIIO::TypeDesc::FLOAT);
    for (int y = 0; y < image->height_px; y++) {
        const deep_pixel *row = image->pixels + size_t(y) * size_t(image->width_px);
        OIIO::DeepData data;
        data.init(image->width_px, spec.nchannels, types, spec.channelnames);
        for (int x = 0; x < image->width_px; x++)
            data.set_samples(x, int(row[x].count));
        for (int x = 0; x < image->width_px; x++)
            for (uint32_t i = 0; i < row[x].count; i++)
                set_deep_sample(data, x, int(i), image->samples[row[x].first + i]);
        if (!output.write_deep_scanlines(y, y + 1, 0, data))
            return false;
    }
    return true;
}

// A file in memory, by a path: the writer of deep images takes no IOProxy.
class MemoryFile
{
    int fd = memfd_create("vitrail-deep", MFD_CLOEXEC);

  public:
    ~MemoryFile()
    {
        if (fd >= 0)
            close(fd);
    }
    bool is_open() const
    {
        return fd >= 0;
    }
    std::string path() const
    {
        return "/proc/self/fd/" + std::to_string(fd);
    }
    bool read(void **bytes, size_t *size_bytes, struct error *err) const
    {
        off_t size = lseek(fd, 0, SEEK_END), at = 0;
        char *memory = size > 0 ? static_cast<char *>(malloc(size_t(size))) : nullptr;
        if (!memory)
            return error_set(err, ERROR_NO_MEMORY, "a deep image of %lld bytes", (long long)size);
        for (ssize_t got; at < size; at += got)
            if ((got = pread(fd, memory + at, size_t(size - at), at)) <= 0) {
                free(memory);
                return error_set(err, ERROR_IO, "a deep image cannot be read back");
            }
        *bytes = memory;
        *size_bytes = size_t(size);
        return true;
    }
};

bool encode_deep(const deep_image *image, const oiio_option *options, void **bytes,
                 size_t *size_bytes, struct error *err)
{
    OIIO::ImageSpec spec(image->width_px, image->height_px, int(DEEP_CHANNELS.size()),
                         OIIO::TypeDesc::FLOAT);
    spec.channelnames = DEEP_CHANNELS;
    spec.alpha_channel = 3;
    spec.z_channel = 7;
    spec.deep = true;
    set_options(options, spec);
    std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("openexr");
    MemoryFile file;
    if (!output || !output->supports("deepdata"))
        return error_set(err, ERROR_UNSUPPORTED, "deep images cannot be written here: %s",
                         first_line(OIIO::geterror()).c_str());
    if (!file.is_open())
        return error_set(err, ERROR_NO_MEMORY, "a deep image");
    output->threads(1);
    if (!output->open(file.path(), spec) || !write_deep(image, *output) || !output->close())
        return error_set(err, ERROR_INTERNAL, "writing a deep image: %s",
                         first_line(output->geterror()).c_str());
    return file.read(bytes, size_bytes, err);
}

bool decode(const void *bytes, size_t size_bytes, const char *format, struct image *image,
            struct error *err)
{
    std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input || !input->supports("ioproxy"))
        return error_set(err, ERROR_UNSUPPORTED, "images cannot be read as %s here: %s", format,
                         first_line(OIIO::geterror()).c_str());
    OIIO::Filesystem::IOMemReader proxy(const_cast<void *>(bytes), size_bytes);
    OIIO::ImageSpec spec, config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    input->threads(1);
    input->set_ioproxy(&proxy);
    if (!input->open(std::string("memory.") + format, spec, config))
        return error_set(err, ERROR_INVALID_SCENE, "%s: %s", format,
                         first_line(input->geterror()).c_str());
    if (spec.depth > 1 || spec.deep)
        return error_set(err, ERROR_UNSUPPORTED, "%s: deep and volume images are not read", format);
    // As floats the library would scale whole numbers to [0, 1].
    image_component component = spec.format == OIIO::TypeDesc::UINT32 ? IMAGE_U32 : IMAGE_F32;
    if (!image_init(image, spec.width, spec.height, spec.nchannels, component, err))
        return false;
    for (int i = 0; i < spec.nchannels && size_t(i) < spec.channelnames.size(); i++)
        strncpy(image->channel_names[i], spec.channelnames[size_t(i)].c_str(),
                IMAGE_CHANNEL_NAME_BYTES - 1);
    if (!input->read_image(0, 0, 0, spec.nchannels, type_of(component), image->pixels))
        return error_set(err, ERROR_INVALID_SCENE, "%s: %s", format,
                         first_line(input->geterror()).c_str());
    return true;
}

constexpr int JOIN_ROWS = 64; // read and written at once: memory is theirs

// One row of tiles, open at once.
struct TileRow {
    std::vector<std::unique_ptr<OIIO::ImageInput>> inputs;
    int width = 0, height = 0; // of the tiles together
};

bool open_row(const oiio_join *desc, int row, TileRow &tiles, struct error *err)
{
    for (int i = 0; i < desc->columns; i++) {
        const char *path = desc->paths[row * desc->columns + i];
        std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(desc->from);
        OIIO::ImageSpec spec, config;
        config.attribute("oiio:UnassociatedAlpha", 1);
        if (!input || !input->open(path, spec, config))
            return error_set(err, ERROR_INTERNAL, "tile %d of row %d: %s", i, row,
                             first_line(input ? input->geterror() : OIIO::geterror()).c_str());
        input->threads(1);
        const OIIO::ImageSpec &first = i ? tiles.inputs[0]->spec() : spec;
        if (spec.deep || !spec.channelformats.empty() || spec.height != first.height ||
            spec.nchannels != first.nchannels || spec.format != first.format)
            return error_set(err, ERROR_INTERNAL, "tile %d of row %d is not like those beside it",
                             i, row);
        tiles.width += spec.width;
        tiles.height = spec.height;
        tiles.inputs.push_back(std::move(input));
    }
    return true;
}

// Some rows of the tiles of a row, side by side, in the channels of the picture.
bool read_strip(const TileRow &tiles, int first, int end, const OIIO::ImageSpec &to,
                std::vector<unsigned char> &tile, std::vector<unsigned char> &strip,
                struct error *err)
{
    size_t size = to.format.size(), out_pixel = size * size_t(to.nchannels), at = 0;
    for (const std::unique_ptr<OIIO::ImageInput> &input : tiles.inputs) {
        const OIIO::ImageSpec spec = input->spec();
        size_t in_pixel = size * size_t(spec.nchannels), width = size_t(spec.width);
        tile.resize(width * size_t(end - first) * in_pixel);
        if (!input->read_scanlines(0, 0, spec.y + first, spec.y + end, 0, 0, spec.nchannels,
                                   to.format, tile.data()))
            return error_set(err, ERROR_INTERNAL, "a tile: %s",
                             first_line(input->geterror()).c_str());
        for (int y = 0; y < end - first; y++)
            for (size_t x = 0; x < width; x++) {
                const unsigned char *in = &tile[(size_t(y) * width + x) * in_pixel];
                unsigned char *out = &strip[(size_t(y) * size_t(to.width) + at + x) * out_pixel];
                for (int c = 0; c < to.nchannels; c++)
                    memcpy(out + size_t(c) * size,
                           in + (spec.nchannels < to.nchannels ? 0 : size_t(c) * size), size);
            }
        at += width;
    }
    return true;
}

// Where rows of a picture go.
struct Picture {
    const oiio_join *desc;
    OIIO::ImageSpec spec;
    OIIO::ImageOutput *output; // none with desc->to_rows
};

bool write_strip(const Picture &picture, int y, int end, const void *strip, struct error *err)
{
    if (const oiio_rows *to = picture.desc->to_rows)
        return to->put(to->context, strip, end - y, err);
    if (!picture.output->write_scanlines(y, end, 0, picture.spec.format, strip))
        return error_set(err, ERROR_IO, "writing the picture: %s",
                         first_line(picture.output->geterror()).c_str());
    return true;
}

bool write_row(const TileRow &tiles, const Picture &picture, int y, struct error *err)
{
    const OIIO::ImageSpec &spec = picture.spec;
    std::vector<unsigned char> tile,
        strip(size_t(JOIN_ROWS) * size_t(spec.width) * size_t(spec.nchannels) * spec.format.size());
    for (int first = 0; first < tiles.height; first += JOIN_ROWS) {
        int end = std::min(first + JOIN_ROWS, tiles.height);
        if (!read_strip(tiles, first, end, spec, tile, strip, err) ||
            !write_strip(picture, y + first, y + end, strip.data(), err))
            return false;
    }
    return true;
}

// What the tiles are, in the size of the picture.
OIIO::ImageSpec spec_of_picture(const oiio_join *desc, const TileRow &row, int height)
{
    OIIO::ImageSpec spec = row.inputs[0]->spec();
    spec.x = spec.y = spec.full_x = spec.full_y = 0;
    spec.width = spec.full_width = row.width;
    spec.height = spec.full_height = height;
    spec.tile_width = spec.tile_height = spec.tile_depth = 0;
    if (desc->to_rows) {
        spec.set_format(OIIO::TypeDesc::UINT8);
        spec.nchannels = desc->to_rows->channels ? desc->to_rows->channels : spec.nchannels;
        spec.default_channel_names();
    } else {
        set_options(desc->options, spec);
    }
    return spec;
}

bool begin_picture(const Picture &picture, struct error *err)
{
    const OIIO::ImageSpec &spec = picture.spec;
    if (const oiio_rows *to = picture.desc->to_rows)
        return to->begin(to->context, spec.width, spec.height, spec.nchannels, err);
    if (!picture.output->open(std::string("picture.") + picture.desc->to, spec))
        return error_set(err, ERROR_IO, "writing the picture: %s",
                         first_line(picture.output->geterror()).c_str());
    return true;
}

bool join_rows(const oiio_join *desc, OIIO::ImageOutput *output, struct error *err)
{
    Picture picture = {desc, {}, output};
    int height = 0;
    for (int row = 0; row < desc->rows; row++) {
        TileRow tiles;
        oiio_join first = *desc;
        first.columns = 1;
        first.paths = desc->paths + row * desc->columns;
        if (!open_row(&first, 0, tiles, err))
            return false;
        height += tiles.height;
    }
    for (int row = 0, y = 0; row < desc->rows; row++) {
        TileRow tiles;
        if (!open_row(desc, row, tiles, err))
            return false;
        if (row == 0) {
            picture.spec = spec_of_picture(desc, tiles, height);
            if (!begin_picture(picture, err))
                return false;
        }
        if (!write_row(tiles, picture, y, err))
            return false;
        y += tiles.height;
    }
    return true;
}

bool join(const oiio_join *desc, struct error *err)
{
    if (desc->to_rows)
        return join_rows(desc, nullptr, err);
    std::unique_ptr<FILE, int (*)(FILE *)> file(fdopen(dup(desc->fd), "wb"), fclose);
    std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(desc->to);
    if (!file || !output || !output->supports("ioproxy"))
        return error_set(err, ERROR_IO, "a picture cannot be written as %s here", desc->to);
    OIIO::Filesystem::IOFile proxy(file.get(), OIIO::Filesystem::IOProxy::Write);
    output->set_ioproxy(&proxy);
    output->threads(1);
    if (!join_rows(desc, output.get(), err))
        return false;
    if (!output->close() || fflush(file.get()) != 0)
        return error_set(err, ERROR_IO, "writing the picture: %s",
                         first_line(output->geterror()).c_str());
    return true;
}

bool join_safely(const oiio_join *desc, struct error *err)
{
    try {
        configure();
        return join(desc, err);
    } catch (const std::bad_alloc &) {
        return error_set(err, ERROR_NO_MEMORY, "joining tiles");
    } catch (const std::exception &e) {
        return error_set(err, ERROR_INTERNAL, "joining tiles: %s", e.what());
    } catch (...) {
        return error_set(err, ERROR_INTERNAL, "joining tiles: unknown exception");
    }
}

bool encode_safely(const struct image *image, const char *format, const oiio_option *options,
                   void **bytes, size_t *size_bytes, struct error *err)
{
    try {
        configure();
        return encode(image, format, options, bytes, size_bytes, err);
    } catch (const std::bad_alloc &) {
        return error_set(err, ERROR_NO_MEMORY, "writing %s", format);
    } catch (const std::exception &e) {
        return error_set(err, ERROR_INTERNAL, "writing %s: %s", format, e.what());
    } catch (...) {
        return error_set(err, ERROR_INTERNAL, "writing %s: unknown exception", format);
    }
}

bool encode_deep_safely(const deep_image *image, const oiio_option *options, void **bytes,
                        size_t *size_bytes, struct error *err)
{
    try {
        configure();
        return encode_deep(image, options, bytes, size_bytes, err);
    } catch (const std::bad_alloc &) {
        return error_set(err, ERROR_NO_MEMORY, "writing a deep image");
    } catch (const std::exception &e) {
        return error_set(err, ERROR_INTERNAL, "writing a deep image: %s", e.what());
    } catch (...) {
        return error_set(err, ERROR_INTERNAL, "writing a deep image: unknown exception");
    }
}

bool decode_safely(const void *bytes, size_t size_bytes, const char *format, struct image *image,
                   struct error *err)
{
    memset(image, 0, sizeof *image);
    bool is_done = false;
    try {
        configure();
        is_done = decode(bytes, size_bytes, format, image, err);
    } catch (const std::bad_alloc &) {
        error_set(err, ERROR_NO_MEMORY, "reading %s", format);
    } catch (const std::exception &e) {
        error_set(err, ERROR_INVALID_SCENE, "reading %s: %s", format, e.what());
    } catch (...) {
        error_set(err, ERROR_INTERNAL, "reading %s: unknown exception", format);
    }
    if (!is_done)
        image_finish(image);
    return is_done;
}

} // namespace

const struct oiio_functions *oiio_get_functions(void)
{
    static const struct oiio_functions functions = {encode_safely, encode_deep_safely,
                                                    decode_safely, join_safely};
    return &functions;
}
