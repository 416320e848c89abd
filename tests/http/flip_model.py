# SPDX-License-Identifier: MIT
"""LDR-FLIP and HDR-FLIP straight from the equations of the papers, slow and plain: what the
program's fast form is compared with. Shares nothing with it, filters are dense and two-dimensional.

Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images";
Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images".
An image is a list of rows of (r, g, b), linear Rec.709."""
import math

PIXELS_PER_DEGREE = 3840 * math.pi / 180

# Rows of XYZ from linear Rec.709 (IEC 61966-2-1), and back.
XYZ_FROM_RGB = ((0.4123907992659595, 0.35758433938387796, 0.1804807884018343),
                (0.21263900587151036, 0.7151686787677559, 0.07219231536073371),
                (0.01933081871559185, 0.11919477979462599, 0.9505321522496606))
RGB_FROM_XYZ = ((3.2409699419045213, -1.5373831775700935, -0.4986107602930033),
                (-0.9692436362808798, 1.8759675015077206, 0.04155505740717561),
                (0.05563007969699361, -0.20397695888897657, 1.0569715142428786))
WHITE = tuple(sum(row) for row in XYZ_FROM_RGB)


def times(matrix, vector):
    return tuple(sum(m * v for m, v in zip(row, vector)) for row in matrix)


def opponent(rgb):
    """Y C_x C_z: CIELab without its cube root."""
    x, y, z = (value / white for value, white in zip(times(XYZ_FROM_RGB, rgb), WHITE))
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def rgb_of(colour):
    y = (colour[0] + 16) / 116
    xyz = y + colour[1] / 500, y, y - colour[2] / 200
    rgb = times(RGB_FROM_XYZ, tuple(v * w for v, w in zip(xyz, WHITE)))
    return tuple(min(max(value, 0), 1) for value in rgb)


def hunt_lab(rgb):
    delta = 6 / 29
    root = [t ** (1 / 3) if t > delta ** 3 else t / (3 * delta ** 2) + 4 / 29
            for t in (v / w for v, w in zip(times(XYZ_FROM_RGB, rgb), WHITE))]
    light = 116 * root[1] - 16
    return light, light / 100 * 500 * (root[0] - root[1]), light / 100 * 200 * (root[1] - root[2])


def hyab(a, b):
    return abs(a[0] - b[0]) + math.hypot(a[1] - b[1], a[2] - b[2])


def sensitivity(terms, ppd):
    """Weights by offset of a sum of Gaussians [(a, b)], which adds up to 1."""
    radius = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi ** 2)) * ppd)
    weights = {}
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            square = (dx * dx + dy * dy) / ppd ** 2
            weights[dx, dy] = sum(a * math.sqrt(math.pi / b) * math.exp(-math.pi ** 2 * square / b)
                                  for a, b in terms)
    total = sum(weights.values())
    return {offset: weight / total for offset, weight in weights.items()}


def feature(ppd, along_y, is_point):
    """First or second derivative of a Gaussian; both signs add up to 1 in size."""
    sigma = 0.5 * 0.082 * ppd
    radius = math.ceil(3 * sigma)
    weights = {}
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            t = dy if along_y else dx
            gauss = math.exp(-(dx * dx + dy * dy) / (2 * sigma ** 2))
            weights[dx, dy] = (t * t / sigma ** 2 - 1 if is_point else -t) * gauss
    positive = sum(w for w in weights.values() if w > 0)
    negative = -sum(w for w in weights.values() if w < 0)
    return {o: w / (positive if w > 0 else negative) for o, w in weights.items()}


def filtered(plane, weights):
    height, width = len(plane), len(plane[0])

    def at(x, y):
        return plane[min(max(y, 0), height - 1)][min(max(x, 0), width - 1)]
    return [[sum(w * at(x + dx, y + dy) for (dx, dy), w in weights.items())
             for x in range(width)] for y in range(height)]


def channel(image, index):
    return [[pixel[index] for pixel in row] for row in image]


def eyes(image, ppd):
    """What is left of the opponent colours at that distance, as Hunt-adjusted Lab."""
    terms = ([(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)])
    planes = [filtered(channel(image, i), sensitivity(terms[i], ppd)) for i in range(3)]
    return [[hunt_lab(rgb_of(colour)) for colour in zip(*rows)] for rows in zip(*planes)]


def lengths(image, ppd, is_point):
    grey = [[(pixel[0] + 16) / 116 for pixel in row] for row in image]
    planes = [filtered(grey, feature(ppd, along_y, is_point)) for along_y in (False, True)]
    return [[math.hypot(dx, dy) for dx, dy in zip(*rows)] for rows in zip(*planes)]


def ldr_flip(reference, image, ppd=PIXELS_PER_DEGREE):
    """The map, rows of values in [0, 1]. Images in [0, 1]."""
    pair = [[[opponent(rgb) for rgb in row] for row in i] for i in (reference, image)]
    seen = [eyes(i, ppd) for i in pair]
    edges = [lengths(i, ppd, False) for i in pair]
    points = [lengths(i, ppd, True) for i in pair]
    largest = hyab(hunt_lab((0, 1, 0)), hunt_lab((0, 0, 1))) ** 0.7
    knee = 0.4 * largest

    def pixel(x, y):
        distance = hyab(seen[0][y][x], seen[1][y][x]) ** 0.7
        if distance < knee:
            distance *= 0.95 / knee
        else:
            distance = 0.95 + 0.05 * (distance - knee) / (largest - knee)
        difference = max(abs(edges[0][y][x] - edges[1][y][x]),
                         abs(points[0][y][x] - points[1][y][x]))
        return distance ** (1 - math.sqrt(difference / math.sqrt(2)))
    return [[pixel(x, y) for x in range(len(reference[0]))] for y in range(len(reference))]


def aces(x):
    x *= 0.6
    return min(max(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0), 1)


def aces_inverse(target):
    low, high = 0, 100
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if aces(middle) < target else (low, middle)
    return low


def hdr_flip(reference, image, ppd=PIXELS_PER_DEGREE):
    light = sorted(times(XYZ_FROM_RGB, rgb)[1] for row in reference for rgb in row)
    knee = aces_inverse(0.85)
    start = math.log2(knee / light[-1])
    stop = math.log2(knee / light[len(light) // 2])
    count = max(2, math.ceil(stop - start))
    result = None
    for i in range(count):
        gain = 2 ** (start + (stop - start) * i / (count - 1))
        shown = [[[tuple(aces(gain * v) for v in rgb) for rgb in row] for row in each]
                 for each in (reference, image)]
        one = ldr_flip(*shown, ppd)
        result = one if result is None else [[max(p) for p in zip(*rows)]
                                             for rows in zip(result, one)]
    return result


def mean(values):
    return sum(map(sum, values)) / (len(values) * len(values[0]))
