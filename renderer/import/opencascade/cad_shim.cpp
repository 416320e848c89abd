// SPDX-License-Identifier: MIT
// The only user of OpenCASCADE (7.6): from a STEP or IGES file in memory to glTF. No
// exception leaves this file, and no file but that of the upload is seen.
#include "renderer/import/opencascade/cad_model.h"

#include <mutex>
#include <new>

#include <IGESControl_Controller.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Controller.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>

namespace vitrail
{

namespace
{

constexpr double MILLIMETRE = 0.001;

std::mutex conversion_mutex; // the controllers and static parameters are those of the process

// The library prints what it thinks of a file to the standard output.
void silence()
{
    Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
}

// CAD has Z up by convention; neither format tells.
struct scene_origin origin_of(const struct converter_input &input, double file_unit_m)
{
    struct scene_origin origin = {input.format,       MILLIMETRE,         'z',
                                  SCENE_WORD_DEFAULT, SCENE_WORD_DEFAULT, 0};
    if (file_unit_m > 0) {
        origin.unit_m = file_unit_m;
        origin.unit_by = SCENE_WORD_FILE;
    }
    if (input.unit_m > 0) {
        origin.unit_m = input.unit_m;
        origin.unit_by = SCENE_WORD_REQUEST;
    }
    if (input.up) {
        origin.up = input.up;
        origin.up_by = SCENE_WORD_REQUEST;
    }
    origin.deflection = input.deflection;
    return origin;
}

void convert_all(const struct converter_input *input, struct converter_output *output)
{
    std::lock_guard<std::mutex> lock(conversion_mutex);
    silence();
    double file_unit_m = 0;
    Handle(TDocStd_Document) document = input->format == SCENE_FORMAT_STEP
                                            ? read_step(*input->root, &file_unit_m)
                                            : read_iges(*input->root, &file_unit_m);
    output->origin = origin_of(*input, file_unit_m);
    // the document is in millimetres, whatever the file was in
    double stated_m = file_unit_m > 0 ? file_unit_m : MILLIMETRE;
    cad_gltf gltf = write_cad_gltf(document, MILLIMETRE / stated_m * output->origin.unit_m,
                                   output->origin.up, input->deflection * stated_m / MILLIMETRE);
    if (gltf.triangles == 0)
        refuse("it holds no surface; curves and points alone are not shown");
    std::string lines;
    if (output->origin.unit_by == SCENE_WORD_DEFAULT)
        lines += "the file does not tell the unit of its coordinates: millimetres are assumed "
                 "(?unit=)\n";
    if (gltf.lost_faces > 0)
        lines += std::to_string(gltf.lost_faces) + " faces have no triangles and are left out\n";
    give(output, gltf.json, gltf.buffer, lines);
}

// As faults of the file and of memory, whatever the version derives them from.
void convert_guarded(const struct converter_input *input, struct converter_output *output)
{
    try {
        convert_all(input, output);
    } catch (const Standard_OutOfMemory &) {
        throw std::bad_alloc();
    } catch (const Standard_Failure &problem) {
        const char *said = problem.GetMessageString();
        refuse("OpenCASCADE: %.120s", said && *said ? said : problem.DynamicType()->Name());
    }
}

bool convert(const struct converter_input *input, struct converter_output *output,
             struct error *err)
{
    *output = {};
    return guarded(
        "OpenCASCADE", [&] { convert_guarded(input, output); }, err);
}

void warm_up()
{
    try {
        silence();
        STEPControl_Controller::Init();
        IGESControl_Controller::Init();
    } catch (...) {
        return; // the conversion will tell
    }
}

} // namespace

} // namespace vitrail

extern "C" const struct converter_functions *converter_get_functions(void)
{
    static const struct converter_functions functions = {vitrail::warm_up, vitrail::convert};
    return &functions;
}
