// SPDX-License-Identifier: MIT
// Fits few nodes to a falling visibility function, one pass, given point by point in the order of
// depth: at no depth is the fit farther from it than u_epsilon in any channel. Lokovic and Veach
// 2000, "Deep shadow maps", section 3.2: a piece begins at a node and goes on as long as there is
// a slope that passes every point so far within the tolerance.
// Two things differ. A piece may also be a constant, with a window of values instead of slopes,
// because a pane is a step: steps then take one node each instead of two; the piece that reaches
// farther is taken. And the fit never rises, and is exactly 1 up to the first node.
// Provides fit_begin(is_lit), fit_point(z, v), fit_finish(), node_count; needs node_write(i, node).
//
// A node is a depth and the visibility behind it, rgb. The sign of red is set where a line leads to
// the next node; else the value stays up to there. Two nodes at one depth are a jump.
uniform float u_epsilon;

#define FIT_STEEPEST 3.0e38

uint node_count = 0u;
float fit_first, fit_last; // depths: where the piece begins, and the last point it has
vec3 fit_in;               // visibility just behind fit_last
vec3 fit_out;              // of the fit, up to fit_first
vec3 fit_origin;           // of a line
vec3 constant_low, constant_high, slope_low, slope_high;
bool fit_is_open;          // the windows are of use
bool fit_is_lit;           // nothing is written yet: the piece is 1 and has no node
bool fit_is_hanging;       // the last piece is a line whose end is not written yet: fit_out
bool has_constant, has_line;

void node_write(uint i, vec4 node);

void fit_emit(float z, vec3 v, bool is_line)
{
    uint sign = is_line ? 0x80000000u : 0u;
    node_write(node_count, vec4(z, uintBitsToFloat(floatBitsToUint(v.x) | sign), v.yz));
    node_count++;
}

// is_lit: nothing acts before the first point that is less than 1.
void fit_begin(bool is_lit)
{
    node_count = 0u;
    fit_first = fit_last = 0.0;
    fit_in = fit_out = vec3(1.0);
    fit_is_open = fit_is_hanging = false;
    fit_is_lit = is_lit;
}

void fit_open()
{
    bool goes_on = fit_is_hanging && all(lessThanEqual(abs(fit_out - fit_in), vec3(u_epsilon)));
    fit_origin = goes_on ? fit_out : min(fit_in, fit_out);
    constant_low = fit_is_lit ? vec3(1.0) : fit_in - u_epsilon;
    constant_high = fit_is_lit ? vec3(1.0) : fit_in + u_epsilon;
    slope_low = vec3(-FIT_STEEPEST);
    slope_high = vec3(FIT_STEEPEST);
    has_constant = true;
    has_line = !fit_is_lit;
    fit_is_open = true;
}

// Ends the piece at fit_last. A constant is taken where it reaches as far as a line.
void fit_close()
{
    if (has_constant) {
        bool joins = fit_is_hanging && all(lessThanEqual(constant_low, fit_out)) &&
                     all(lessThanEqual(fit_out, constant_high));
        vec3 middle = 0.5 * (constant_low + constant_high);
        vec3 v = joins ? fit_out : max(min(middle, fit_out), constant_low);
        if (fit_is_hanging && !joins)
            fit_emit(fit_first, fit_out, false);
        if (!fit_is_lit)
            fit_emit(fit_first, max(v, vec3(0.0)), false);
        fit_out = max(v, vec3(0.0));
        fit_is_hanging = false;
    } else {
        if (fit_is_hanging && any(notEqual(fit_origin, fit_out)))
            fit_emit(fit_first, fit_out, false);
        fit_emit(fit_first, fit_origin, true);
        vec3 slope = min(0.5 * slope_low + 0.5 * slope_high, vec3(0.0));
        fit_out = max(fit_origin + slope * (fit_last - fit_first), vec3(0.0));
        fit_is_hanging = true;
    }
    fit_is_lit = false;
    fit_first = fit_last;
    fit_is_open = false;
}

// Narrows what windows can take the point. False where none can: then they are as before.
bool fit_narrow(float z, vec3 v)
{
    vec3 low = max(constant_low, v - u_epsilon), high = min(constant_high, v + u_epsilon);
    float run = z - fit_first;
    vec3 from = max(slope_low, (max(v - u_epsilon, vec3(0.0)) - fit_origin) / run);
    vec3 to = min(slope_high, (v + u_epsilon - fit_origin) / run);
    bool takes_constant = has_constant && all(lessThanEqual(low, high));
    bool takes_line = has_line && all(lessThanEqual(from, to));
    if (!takes_constant && !takes_line)
        return false;
    has_constant = takes_constant;
    has_line = takes_line;
    constant_low = low;
    constant_high = high;
    slope_low = from;
    slope_high = to;
    return true;
}

// z never falls, v never rises. Points at one depth are both sides of a drop.
void fit_point(float z, vec3 v)
{
    if (!fit_is_open && z > fit_first)
        fit_open();
    if (fit_is_open && !fit_narrow(z, v)) {
        fit_close();
        if (z > fit_first) {
            fit_open();
            fit_narrow(z, v); // a line can always take its first point
        }
    }
    fit_last = z;
    fit_in = v;
}

// From the last point on nothing changes.
void fit_finish()
{
    if (fit_is_open && !has_constant)
        fit_close();
    if (!fit_is_open)
        fit_open();
    fit_close();
}
