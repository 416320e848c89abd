/* SPDX-License-Identifier: MIT */
/* The plot of a trade-off: scales, axes, points, labels, legend. */
#include "server/tradeoffs/tradeoff_plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    WIDTH = 960,
    HEIGHT = 580,
    LEFT = 84,
    RIGHT = 780,
    TOP = 84,
    BOTTOM = 512,
    LABELS_MAX = 64,
    FONT_PX = 11,
};

/* Literal colours as attributes, which every program that reads SVG knows; classes are for the dark
 * scheme alone. */
#define PAPER "#fff"
#define INK "#1b1b1f"
#define DIM "#5b5b66"
#define A_PAPER "class=\"paper\" fill=\"" PAPER "\""
#define A_GRID "class=\"grid\" stroke=\"#e4e4ea\""
#define A_FRAME "class=\"frame\" fill=\"none\" stroke=\"" DIM "\""
#define A_TITLE "class=\"title\" font-size=\"18\" font-weight=\"600\" fill=\"" INK "\""
#define A_SUBTITLE "class=\"subtitle\" font-size=\"12\" fill=\"" DIM "\""
#define A_TICK "class=\"tick\" font-size=\"12\" fill=\"" DIM "\""
#define A_AXIS "class=\"axis\" font-size=\"13\" fill=\"" INK "\""
#define A_KEY "class=\"key\" font-size=\"13\" fill=\"" INK "\""
#define A_LABEL "class=\"label\" font-size=\"11\" fill=\"" INK "\"" /* FONT_PX */
#define A_LEADER "class=\"leader\" stroke=\"" DIM "\" stroke-width=\".7\""
#define A_MEDIA "class=\"media\" fill=\"none\" stroke=\"" DIM "\" stroke-width=\"1\""
#define A_FRONT                                                              \
    "class=\"front\" fill=\"none\" stroke=\"" INK "\" stroke-width=\"1.5\" " \
    "stroke-dasharray=\"5 3\""

enum shape {
    SHAPE_CROSS,
    SHAPE_TRIANGLE,
    SHAPE_SQUARE,
    SHAPE_DIAMOND,
    SHAPE_CIRCLE,
    SHAPE_DROP,  /* three quarters of a circle and a corner */
    SHAPE_WEDGE, /* a triangle on its tip */
};

/* Of techniques by their number. Where there are more techniques, colours repeat with other shapes.
 */
static const struct mark {
    const char *color, *dark; /* on paper; in the dark scheme */
    enum shape shape;
} marks[] = {
    {INK, "#ececf1", SHAPE_SQUARE},         {"#7a7a86", "#9a9aa6", SHAPE_CROSS},
    {"#00795a", "#35c79a", SHAPE_TRIANGLE}, {"#c44e00", "#ff9248", SHAPE_SQUARE},
    {"#a8407f", "#e58ac2", SHAPE_DIAMOND},  {"#0063a8", "#63b8ff", SHAPE_CIRCLE},
    {"#5b4bc9", "#a99cff", SHAPE_DROP},     {"#8a6d00", "#e2c04a", SHAPE_WEDGE},
    {"#006d77", "#4fc9d4", SHAPE_DIAMOND},  {"#a02c2c", "#ff8a80", SHAPE_TRIANGLE},
};
enum { MARKS = sizeof marks / sizeof *marks, SHAPES = SHAPE_WEDGE + 1, NEXT_SHAPE = 3 };
_Static_assert(SHADOWS_COUNT <= SHAPES * MARKS && SHAPES % NEXT_SHAPE != 0,
               "each has its own mark");

static int mark_of(int technique)
{
    return technique % MARKS;
}

static enum shape shape_of(int technique)
{
    return (marks[mark_of(technique)].shape + NEXT_SHAPE * (technique / MARKS)) % SHAPES;
}

struct box {
    double x0, y0, x1, y1;
};

struct plot {
    FILE *out;
    const struct tradeoff *tradeoff;
    double x0, x1, y0, y1; /* decimal logarithms at the ends of the axes */
    struct box taken[TRADEOFF_ROWS_MAX + LABELS_MAX];
    int taken_count;
};

void xml_write(FILE *out, const char *text)
{
    for (; *text; text++) {
        const char *escaped = *text == '&'    ? "&amp;"
                              : *text == '<'  ? "&lt;"
                              : *text == '>'  ? "&gt;"
                              : *text == '"'  ? "&quot;"
                              : *text == '\'' ? "&#39;"
                                              : NULL;
        if (escaped)
            fputs(escaped, out);
        else
            fputc(*text, out);
    }
}

/* ---- scales ---- */

static bool is_shown(const struct tradeoff_row *row)
{
    return row->warm.count > 0 && tradeoff_times_median(&row->warm) > 0;
}

static double row_ms(const struct tradeoff_row *row)
{
    return tradeoff_times_median(&row->warm);
}

/* An error of 0 has no logarithm: it is drawn at the lower end. */
static double smallest_error(const struct tradeoff *tradeoff)
{
    double least = INFINITY;
    for (int i = 0; i < tradeoff->row_count; i++)
        if (is_shown(&tradeoff->rows[i]) && tradeoff->rows[i].rmse > 0)
            least = fmin(least, tradeoff->rows[i].rmse);
    return isfinite(least) ? least : 1e-3;
}

static double row_error(const struct plot *plot, const struct tradeoff_row *row)
{
    return row->rmse > 0 ? row->rmse : pow(10, plot->y0);
}

/* Room around the points, and never less than half a decade, so that noise does not look like a
 * trend. */
static void widen(double *low, double *high)
{
    double middle = (*low + *high) / 2, half = fmax((*high - *low) / 2 + 0.08, 0.25);
    *low = middle - half;
    *high = middle + half;
}

static void find_scales(struct plot *plot)
{
    double least = smallest_error(plot->tradeoff);
    plot->x0 = plot->y0 = INFINITY;
    plot->x1 = plot->y1 = -INFINITY;
    for (int i = 0; i < plot->tradeoff->row_count; i++) {
        const struct tradeoff_row *row = &plot->tradeoff->rows[i];
        if (!is_shown(row))
            continue;
        double x = log10(row_ms(row)), y = log10(row->rmse > 0 ? row->rmse : least / 2);
        plot->x0 = fmin(plot->x0, x);
        plot->x1 = fmax(plot->x1, x);
        plot->y0 = fmin(plot->y0, y);
        plot->y1 = fmax(plot->y1, y);
    }
    if (!isfinite(plot->x0)) {
        plot->x0 = 0, plot->x1 = 3;
        plot->y0 = -3, plot->y1 = 0;
    }
    widen(&plot->x0, &plot->x1);
    widen(&plot->y0, &plot->y1);
}

static double to_x(const struct plot *plot, double ms)
{
    return LEFT + (log10(ms) - plot->x0) / (plot->x1 - plot->x0) * (RIGHT - LEFT);
}

static double to_y(const struct plot *plot, double error)
{
    return BOTTOM - (log10(error) - plot->y0) / (plot->y1 - plot->y0) * (BOTTOM - TOP);
}

/* ---- axes ---- */

static void write_tick(struct plot *plot, double value, bool is_x, bool has_text)
{
    FILE *out = plot->out;
    if (is_x) {
        double x = to_x(plot, value);
        fprintf(out, "<line " A_GRID " x1=\"%.1f\" x2=\"%.1f\" y1=\"%d\" y2=\"%d\"/>\n", x, x, TOP,
                BOTTOM);
        if (has_text)
            fprintf(out, "<text " A_TICK " x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%g</text>\n",
                    x, BOTTOM + 18, value);
    } else {
        double y = to_y(plot, value);
        fprintf(out, "<line " A_GRID " x1=\"%d\" x2=\"%d\" y1=\"%.1f\" y2=\"%.1f\"/>\n", LEFT,
                RIGHT, y, y);
        if (has_text)
            fprintf(out, "<text " A_TICK " x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%g</text>\n",
                    LEFT - 8, y + 4, value);
    }
}

/* Ticks at 1, 2 and 5 of each decade; over more than three decades only the first has a text. */
static void write_axis(struct plot *plot, bool is_x)
{
    static const double steps[] = {1, 2, 5};
    double low = is_x ? plot->x0 : plot->y0, high = is_x ? plot->x1 : plot->y1;
    for (int decade = (int)floor(low); decade <= (int)ceil(high); decade++)
        for (int i = 0; i < 3; i++) {
            double value = steps[i] * pow(10, decade), at = log10(value);
            if (at >= low && at <= high)
                write_tick(plot, value, is_x, i == 0 || high - low <= 3);
        }
}

static void write_frame(struct plot *plot)
{
    FILE *out = plot->out;
    write_axis(plot, true);
    write_axis(plot, false);
    fprintf(out, "<rect " A_FRAME " x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\"/>\n", LEFT, TOP,
            RIGHT - LEFT, BOTTOM - TOP);
    fprintf(out,
            "<text " A_AXIS " x=\"%d\" y=\"%d\" text-anchor=\"middle\">time of a frame with its "
            "shadow structures kept [ms]</text>\n",
            (LEFT + RIGHT) / 2, BOTTOM + 44);
    fprintf(out,
            "<text " A_AXIS " text-anchor=\"middle\" transform=\"translate(24 %d) "
            "rotate(-90)\">RMSE of linear colour [1 = white]</text>\n",
            (TOP + BOTTOM) / 2);
}

static void write_title(struct plot *plot)
{
    FILE *out = plot->out;
    const struct tradeoff *t = plot->tradeoff;
    fprintf(out,
            "<text " A_TITLE " x=\"%d\" y=\"32\">Time against error, scene %.12s…, %d×%d "
            "px</text>\n",
            LEFT, t->scene, t->width, t->height);
    fprintf(out, "<text " A_SUBTITLE " x=\"%d\" y=\"52\">", LEFT);
    xml_write(out, t->device[0] ? t->device : "device not known yet");
    fprintf(out, "</text>\n<text " A_SUBTITLE " x=\"%d\" y=\"70\">", LEFT);
    fprintf(out, "%d settings, reference ray-traced with %d samples per pixel", t->row_count,
            t->options.reference_samples);
    fprintf(out, "%s</text>\n", t->is_partial ? "; partial" : "");
}

/* ---- points ---- */

static void write_shape(FILE *out, enum shape shape, double x, double y, double r)
{
    switch (shape) {
    case SHAPE_CIRCLE:
        fprintf(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>", x, y, r);
        break;
    case SHAPE_DROP:
        fprintf(out, "<path d=\"M%.1f %.1fv%.1fa%.1f %.1f 0 1 1 %.1f %.1fz\"/>", x + r, y - r, r, r,
                r, -r, -r);
        break;
    case SHAPE_SQUARE:
        fprintf(out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>", x - r, y - r,
                2 * r, 2 * r);
        break;
    case SHAPE_TRIANGLE:
        fprintf(out, "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fz\"/>", x, y - 1.2 * r, x + 1.1 * r,
                y + 0.8 * r, x - 1.1 * r, y + 0.8 * r);
        break;
    case SHAPE_DIAMOND:
        fprintf(out, "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fL%.1f %.1fz\"/>", x, y - 1.4 * r,
                x + 1.4 * r, y, x, y + 1.4 * r, x - 1.4 * r, y);
        break;
    case SHAPE_WEDGE:
        fprintf(out, "<path d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fz\"/>", x, y + 1.2 * r, x + 1.1 * r,
                y - 0.8 * r, x - 1.1 * r, y - 0.8 * r);
        break;
    case SHAPE_CROSS:
        fprintf(out, "<path d=\"M%.1f %.1fL%.1f %.1fM%.1f %.1fL%.1f %.1f\"/>", x - r, y - r, x + r,
                y + r, x - r, y + r, x + r, y - r);
        break;
    }
}

static void begin_mark(FILE *out, const char *id, int technique, bool is_hollow)
{
    const char *color = marks[mark_of(technique)].color;
    fprintf(out, "<g%s class=\"point t%d%s\" stroke-width=\"1.8\" stroke=\"%s\" fill=\"%s\">", id,
            mark_of(technique), is_hollow ? " one" : "", color, is_hollow ? PAPER : color);
}

static void write_point(struct plot *plot, int index)
{
    FILE *out = plot->out;
    const struct tradeoff_row *row = &plot->tradeoff->rows[index];
    char label[TRADEOFF_LABEL_BYTES], id[24];
    double x = to_x(plot, row_ms(row)), y = to_y(plot, row_error(plot, row));
    tradeoff_setting_label(&row->setting, label);
    snprintf(id, sizeof id, " id=\"m%d\"", index);
    begin_mark(out, id, (int)row->setting.shadows, row->setting.samples == 1);
    fprintf(out, "<title>%s: %.4g ms warm, %.4g ms cold, RMSE %.4g, p99.9 %.4g, max %.4g", label,
            row_ms(row), tradeoff_times_median(&row->cold), row->rmse, row->p999, row->max);
    if (row->flip >= 0)
        fprintf(out, ", FLIP %.4g", row->flip);
    fprintf(out, ", %.1f MiB</title>", (double)row->bytes / 1048576.);
    write_shape(out, shape_of((int)row->setting.shadows), x, y, row->is_on_front ? 6 : 4.5);
    fputs("</g>\n", out);
    plot->taken[plot->taken_count++] = (struct box){x - 6, y - 6, x + 6, y + 6};
}

/* The rows of the front, fastest first. */
static int find_front(const struct tradeoff *tradeoff, int front[TRADEOFF_ROWS_MAX])
{
    int count = 0;
    for (int i = 0; i < tradeoff->row_count; i++) {
        const struct tradeoff_row *row = &tradeoff->rows[i];
        if (!row->is_on_front || !is_shown(row))
            continue;
        int at = count++;
        for (; at > 0 && row_ms(&tradeoff->rows[front[at - 1]]) > row_ms(row); at--)
            front[at] = front[at - 1];
        front[at] = i;
    }
    return count;
}

/* A stair: between two of its points the slower one is no better than the faster. */
static void write_front(struct plot *plot, const int *front, int count)
{
    if (count == 0)
        return;
    fputs("<path " A_FRONT " d=\"", plot->out);
    double last_y = 0;
    for (int i = 0; i < count; i++) {
        const struct tradeoff_row *row = &plot->tradeoff->rows[front[i]];
        double x = to_x(plot, row_ms(row)), y = to_y(plot, row_error(plot, row));
        if (i == 0)
            fprintf(plot->out, "M%.1f %.1f", x, y);
        else
            fprintf(plot->out, "L%.1f %.1fL%.1f %.1f", x, last_y, x, y);
        last_y = y;
    }
    fputs("\"/>\n", plot->out);
}

/* ---- settings that differ in their atmosphere samples alone ---- */

static bool is_same_but_media(const struct quality_setting *a, const struct quality_setting *b)
{
    return a->shadows == b->shadows && a->samples == b->samples &&
           a->shadow_resolution == b->shadow_resolution && a->shadow_taps == b->shadow_taps &&
           a->shadow_compression == b->shadow_compression &&
           a->shadow_prefilter == b->shadow_prefilter && a->transparency == b->transparency;
}

/* A thread from the row of the default to each of fewer or more. False where it has none. */
static bool write_media_threads(struct plot *plot, int base)
{
    const struct tradeoff_row *rows = plot->tradeoff->rows, *from = &rows[base];
    bool has_any = false;
    if (from->setting.atmosphere_samples || !is_shown(from))
        return false;
    for (int i = 0; i < plot->tradeoff->row_count; i++) {
        if (i == base || !is_shown(&rows[i]) ||
            !is_same_but_media(&rows[i].setting, &from->setting))
            continue;
        fprintf(plot->out, "<path " A_MEDIA " d=\"M%.1f %.1fL%.1f %.1f\"/>\n",
                to_x(plot, row_ms(from)), to_y(plot, row_error(plot, from)),
                to_x(plot, row_ms(&rows[i])), to_y(plot, row_error(plot, &rows[i])));
        has_any = true;
    }
    return has_any;
}

/* ---- labels ---- */

static bool is_free(const struct plot *plot, const struct box *box)
{
    if (box->x0 < LEFT + 2 || box->x1 > RIGHT - 2 || box->y0 < TOP + 2 || box->y1 > BOTTOM - 2)
        return false;
    for (int i = 0; i < plot->taken_count; i++) {
        const struct box *other = &plot->taken[i];
        if (box->x0 < other->x1 && other->x0 < box->x1 && box->y0 < other->y1 &&
            other->y0 < box->y1)
            return false;
    }
    return true;
}

static void write_short_label(const struct quality_setting *setting,
                              char text[TRADEOFF_LABEL_BYTES])
{
    char extras[TRADEOFF_EXTRAS_BYTES], media[TRADEOFF_MEDIA_BYTES];
    tradeoff_extras_label(setting, extras);
    tradeoff_media_label(setting, media);
    const char *name = shadow_technique_name((int)setting->shadows);
    snprintf(text, TRADEOFF_LABEL_BYTES, "%s%s%s×%d%s", name, extras, *extras ? ", " : " ",
             setting->samples, media);
}

/* Tries places around the point, ever farther; a point in a crowd goes without a label. */
static void write_label(struct plot *plot, const struct tradeoff_row *row)
{
    static const double places[][2] = {{1, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, 0}, {-1, 0}};
    char text[TRADEOFF_LABEL_BYTES];
    write_short_label(&row->setting, text);
    double x = to_x(plot, row_ms(row)), y = to_y(plot, row_error(plot, row));
    double width = 0.56 * FONT_PX * (double)strlen(text), height = FONT_PX + 2;
    for (int i = 0; i < 24 && plot->taken_count < TRADEOFF_ROWS_MAX + LABELS_MAX; i++) {
        const double *place = places[i % 6];
        int lap = i / 6;
        double away = 9 + 12. * lap;
        double left = place[0] > 0 ? x + away : x - away - width;
        double middle = y + place[1] * away;
        struct box box = {left, middle - height / 2, left + width, middle + height / 2};
        if (!is_free(plot, &box))
            continue;
        plot->taken[plot->taken_count++] = box;
        if (away > 12)
            fprintf(plot->out,
                    "<line " A_LEADER " x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>", x, y,
                    place[0] > 0 ? left - 1 : left + width + 1, middle);
        fprintf(plot->out, "<text " A_LABEL " x=\"%.1f\" y=\"%.1f\">%s</text>\n", left, middle + 4,
                text);
        return;
    }
}

static void write_legend(struct plot *plot, bool has_threads)
{
    FILE *out = plot->out;
    bool is_used[SHADOWS_COUNT] = {false}, has_one = false;
    int y = TOP + 12, x = RIGHT + 24;
    for (int i = 0; i < plot->tradeoff->row_count; i++) {
        is_used[plot->tradeoff->rows[i].setting.shadows] = true;
        has_one |= plot->tradeoff->rows[i].setting.samples == 1;
    }
    for (int s = 0; shadow_technique_name(s); s++) {
        if (!is_used[s])
            continue;
        begin_mark(out, "", s, false);
        write_shape(out, shape_of(s), x, y, 5);
        fprintf(out, "</g><text " A_KEY " x=\"%d\" y=\"%d\">%s</text>\n", x + 14, y + 4,
                shadow_technique_name(s));
        y += 22;
    }
    if (has_one) {
        begin_mark(out, "", SHADOWS_AUTO, true);
        write_shape(out, SHAPE_CIRCLE, x, y, 5);
        fprintf(out, "</g><text " A_KEY " x=\"%d\" y=\"%d\">hollow: 1 sample</text>\n", x + 14,
                y + 4);
        y += 22;
    }
    if (has_threads) {
        fprintf(out,
                "<path " A_MEDIA " d=\"M%d %dh16\"/><text " A_KEY
                " x=\"%d\" y=\"%d\">fewer or more</text><text " A_KEY
                " x=\"%d\" y=\"%d\">media samples</text>\n",
                x - 8, y, x + 14, y + 4, x + 14, y + 19);
        y += 37;
    }
    fprintf(out,
            "<path " A_FRONT " d=\"M%d %dh16\"/><text " A_KEY " x=\"%d\" y=\"%d\">nothing is "
            "faster</text><text " A_KEY " x=\"%d\" y=\"%d\">and as good</text>\n",
            x - 8, y, x + 14, y + 4, x + 14, y + 19);
}

static void write_style(FILE *out)
{
    fputs("<style>@media(prefers-color-scheme:dark){.plot .paper{fill:#17171b}"
          ".plot text{fill:#ececf1}.plot .tick,.plot .subtitle{fill:#a5a5b2}"
          ".plot .grid{stroke:#2e2e36}.plot .frame,.plot .leader,.plot .media{stroke:#a5a5b2}"
          ".plot .front{stroke:#ececf1}",
          out);
    for (int i = 0; i < MARKS; i++)
        fprintf(out, ".plot .t%d{fill:%s;stroke:%s}", i, marks[i].dark, marks[i].dark);
    fputs(".plot .one{fill:#17171b}}</style>\n", out);
}

char *tradeoff_to_svg(const struct tradeoff *tradeoff)
{
    char *text = NULL;
    size_t size_bytes = 0;
    int front[TRADEOFF_ROWS_MAX];
    struct plot *plot = calloc(1, sizeof *plot);
    FILE *out = plot ? open_memstream(&text, &size_bytes) : NULL;
    if (!out) {
        free(plot);
        return NULL;
    }
    plot->out = out;
    plot->tradeoff = tradeoff;
    find_scales(plot);
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 %d %d\" "
            "role=\"img\" aria-label=\"time against error\" "
            "font-family=\"system-ui, 'DejaVu Sans', sans-serif\">\n",
            WIDTH, HEIGHT);
    write_style(out);
    fprintf(out, "<rect " A_PAPER " width=\"%d\" height=\"%d\"/>\n", WIDTH, HEIGHT);
    write_title(plot);
    write_frame(plot);
    int count = find_front(tradeoff, front);
    bool has_threads = false;
    write_front(plot, front, count);
    for (int i = 0; i < tradeoff->row_count; i++)
        has_threads |= write_media_threads(plot, i);
    for (int i = 0; i < tradeoff->row_count; i++)
        if (is_shown(&tradeoff->rows[i]))
            write_point(plot, i);
    for (int i = 0; i < count; i++)
        write_label(plot, &tradeoff->rows[front[i]]);
    write_legend(plot, has_threads);
    fputs("</svg>\n", out);
    free(plot);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}
