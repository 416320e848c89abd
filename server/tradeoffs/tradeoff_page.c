/* SPDX-License-Identifier: MIT */
/* The page of a trade-off: plot, pictures side by side, table; one file, no script. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/tradeoffs/tradeoff_plot.h"

static const char page_style[] =
    "<style>body{margin:0 auto;max-width:1280px;padding:1rem;background:#fff;color:#1b1b1f;"
    "font:15px/1.45 system-ui,'DejaVu Sans',sans-serif}"
    "h1{font-size:1.3rem;margin:.2rem 0}p{margin:.3rem 0}svg{width:100%;height:auto}"
    "table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}"
    "th,td{padding:.2rem .5rem;text-align:right;border-bottom:1px solid #e4e4ea}"
    "th:first-child,td:first-child{text-align:left}tr:hover td,tr:focus td{background:#eef4ff}"
    ".front td:first-child{font-weight:600}.wide{overflow-x:auto}"
    ".stage{position:sticky;top:0;display:grid;grid-template-columns:1fr 1fr;gap:.5rem;"
    "background:#fff;padding:.3rem 0;border-bottom:1px solid #e4e4ea}"
    ".stage figure{margin:0;min-width:0}.stage img{width:100%;max-height:42vh;object-fit:contain;"
    "display:block;background:repeating-conic-gradient(#ccc 0 25%,#eee 0 50%) 0 0/16px 16px}"
    ".pick{display:grid}.pick>figure{grid-area:1/1;visibility:hidden}"
    ".pick>figure:first-child{visibility:visible}"
    "figcaption{font-size:.85rem;white-space:nowrap;overflow:hidden;text-overflow:ellipsis}"
    "@media(prefers-color-scheme:dark){body,.stage{background:#17171b;color:#ececf1}"
    "th,td,.stage{border-color:#2e2e36}tr:hover td,tr:focus td{background:#23304a}}\n";

/* ---- pictures ---- */

static void write_base64(FILE *out, const unsigned char *bytes, size_t size_bytes)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size_bytes; i += 3) {
        unsigned left = (unsigned)(size_bytes - i < 3 ? size_bytes - i : 3);
        unsigned group = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
                         (left > 2 ? (unsigned)bytes[i + 2] : 0);
        fputc(digits[group >> 18], out);
        fputc(digits[group >> 12 & 63], out);
        fputc(left > 1 ? digits[group >> 6 & 63] : '=', out);
        fputc(left > 2 ? digits[group & 63] : '=', out);
    }
}

/* False when the file does not hold it: then nothing is written. */
static bool write_image(FILE *out, int fd, uint64_t offset, uint64_t bytes, const char *alt)
{
    struct stat file;
    if (fd < 0 || bytes == 0 || fstat(fd, &file) != 0 || offset > (uint64_t)file.st_size ||
        bytes > (uint64_t)file.st_size - offset)
        return false;
    unsigned char *content = malloc(bytes);
    bool is_read = content && pread(fd, content, bytes, (off_t)offset) == (ssize_t)bytes;
    if (is_read) {
        fprintf(out, "<img alt=\"%s\" src=\"data:image/webp;base64,", alt);
        write_base64(out, content, bytes);
        fputs("\">", out);
    }
    free(content);
    return is_read;
}

/* The row that stands beside the reference until another is pointed at: the best of the front. */
static int first_shown(const struct tradeoff *tradeoff)
{
    int best = -1;
    for (int i = 0; i < tradeoff->row_count; i++)
        if (tradeoff->rows[i].image_bytes &&
            (best < 0 || tradeoff->rows[i].rmse < tradeoff->rows[best].rmse))
            best = i;
    return best;
}

static void write_figure(FILE *out, const struct tradeoff *tradeoff, int row, int images_fd)
{
    char label[TRADEOFF_LABEL_BYTES];
    const struct tradeoff_row *at = &tradeoff->rows[row];
    tradeoff_setting_label(&at->setting, label);
    fprintf(out, "<figure id=\"i%d\">", row);
    write_image(out, images_fd, at->image_offset, at->image_bytes, label);
    fprintf(out, "<figcaption>%s: RMSE %.4g", label, at->rmse);
    if (at->warm.count)
        fprintf(out, ", %.4g ms", tradeoff_times_median(&at->warm));
    fputs("</figcaption></figure>\n", out);
}

static void write_stage(FILE *out, const struct tradeoff *tradeoff, int images_fd)
{
    int first = first_shown(tradeoff);
    if (images_fd < 0 || first < 0 || !tradeoff->reference_bytes)
        return;
    fputs("<div class=\"stage\"><figure>", out);
    write_image(out, images_fd, tradeoff->reference_offset, tradeoff->reference_bytes, "reference");
    fprintf(out,
            "<figcaption>reference: ray-traced, %d samples per pixel</figcaption></figure>\n"
            "<div class=\"pick\">",
            tradeoff->options.reference_samples);
    write_figure(out, tradeoff, first, images_fd);
    for (int i = 0; i < tradeoff->row_count; i++)
        if (i != first && tradeoff->rows[i].image_bytes)
            write_figure(out, tradeoff, i, images_fd);
    fputs("</div></div>\n", out);
}

/* One rule per row: pointing at its mark or its line shows its picture. */
static void write_rules(FILE *out, const struct tradeoff *tradeoff)
{
    for (int i = 0; i < tradeoff->row_count; i++)
        if (tradeoff->rows[i].image_bytes)
            fprintf(out,
                    "body:has(#m%d:hover,#r%d:hover,#r%d:focus) .pick>figure{visibility:hidden}"
                    "body:has(#m%d:hover,#r%d:hover,#r%d:focus) .pick>#i%d{visibility:visible}\n",
                    i, i, i, i, i, i, i);
}

/* ---- table ---- */

static void write_times(FILE *out, const struct tradeoff_times *times)
{
    if (times->count)
        fprintf(out, "<td>%.1f</td><td>%.1f</td>", tradeoff_times_median(times),
                tradeoff_times_spread(times));
    else
        fputs("<td>–</td><td>–</td>", out);
}

static void write_row(FILE *out, const struct tradeoff *tradeoff, int index)
{
    char label[TRADEOFF_LABEL_BYTES];
    const struct tradeoff_row *row = &tradeoff->rows[index];
    tradeoff_setting_label(&row->setting, label);
    fprintf(out, "<tr id=\"r%d\" tabindex=\"0\"%s><td>%s</td>", index,
            row->is_on_front ? " class=\"front\"" : "", label);
    write_times(out, &row->warm);
    write_times(out, &row->cold);
    fprintf(out, "<td>%.4g</td><td>%.4g</td><td>%.4g</td>", row->rmse, row->p999, row->max);
    if (row->flip >= 0)
        fprintf(out, "<td>%.4g</td>", row->flip);
    else
        fputs("<td>–</td>", out);
    fprintf(out, "<td>%.1f</td></tr>\n", (double)row->bytes / 1048576.);
}

static void write_table(FILE *out, const struct tradeoff *tradeoff)
{
    fputs("<div class=\"wide\"><table><thead><tr><th>setting</th><th>warm ms</th><th>±</th>"
          "<th>cold ms</th><th>±</th><th>RMSE</th><th>p99.9</th><th>max</th><th>FLIP</th>"
          "<th>MiB</th></tr></thead><tbody>\n",
          out);
    for (int i = 0; i < tradeoff->row_count; i++)
        write_row(out, tradeoff, i);
    fputs("</tbody></table></div>\n", out);
}

static void write_texts(FILE *out, const struct tradeoff *tradeoff)
{
    if (tradeoff->problem.code != ERROR_NONE) {
        fputs("<p><strong>", out);
        xml_write(out, tradeoff->problem.message);
        fputs("</strong></p>\n", out);
    }
    if (tradeoff->skip_count || tradeoff->warning_count)
        fputs("<h2>What was left out</h2><ul>\n", out);
    for (int i = 0; i < tradeoff->skip_count; i++) {
        fputs("<li>", out);
        xml_write(out, tradeoff->skips[i].what);
        fputs(": ", out);
        xml_write(out, tradeoff->skips[i].because);
        fputs("</li>\n", out);
    }
    for (int i = 0; i < tradeoff->warning_count; i++) {
        fputs("<li>", out);
        xml_write(out, tradeoff->warnings[i]);
        fputs("</li>\n", out);
    }
    if (tradeoff->skip_count || tradeoff->warning_count)
        fputs("</ul>\n", out);
}

char *tradeoff_to_html(const struct tradeoff *tradeoff, int images_fd)
{
    char *text = NULL, *svg = tradeoff_to_svg(tradeoff);
    size_t size_bytes = 0;
    FILE *out = svg ? open_memstream(&text, &size_bytes) : NULL;
    if (!out) {
        free(svg);
        return NULL;
    }
    fprintf(out,
            "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">"
            "<meta name=\"viewport\" content=\"width=device-width\">"
            "<meta name=\"color-scheme\" content=\"light dark\">"
            "<title>Trade-off %s</title>\n%s",
            tradeoff->id, page_style);
    write_rules(out, tradeoff);
    fprintf(out,
            "</style></head><body>\n<h1>Trade-off %s</h1><p>%s%s after %.1f s. "
            "Bold settings are on the front; times are medians with their median absolute "
            "deviation. Point at a line or a mark to see its picture.</p>\n",
            tradeoff->id, tradeoff_state_name((int)tradeoff->state),
            tradeoff->is_partial ? ", partial," : "", tradeoff->elapsed_s);
    write_stage(out, tradeoff, images_fd);
    fputs(svg, out);
    free(svg);
    write_table(out, tradeoff);
    write_texts(out, tradeoff);
    fputs("</body></html>\n", out);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}
