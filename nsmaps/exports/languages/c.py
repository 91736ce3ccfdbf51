"""A program as C99 with a header: one function for a state, one for many, and one for each polynomial map."""

import math
from collections.abc import Sequence
from string import Template

from nsmaps.exports.conditions import C
from nsmaps.exports.formulas import admissible, images_of, lines_of, scaled_inputs, seen_by_regions, starts_of, wrapped_angles
from nsmaps.exports.program import Exportable, Part, Program, program_of

HEADER = Template("""/*
$about
 *
 * Compile with -std=c99, link with -lm.
 */
#ifndef $guard
#define $guard

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* $what */
$returns $name(const double state[$n], double image[$m]);

/* The same of count states, row after row: states (count, $n), images (count, $m)$pieces_about. */
void ${name}_batch(size_t count, const double *states, double *images$pieces);

/* Each polynomial map alone, wherever the state is; angles are not wrapped. */
$parts

#ifdef __cplusplus
}
#endif

#endif
""")
SOURCE = Template("""/* $title. See $name.h. */
#include "$name.h"

#include <math.h>

$series
$functions
$parts
$main
void ${name}_batch(size_t count, const double *states, double *images$pieces)
{
    for (size_t k = 0; k < count; ++k)$call
}
""")
SERIES = Template("""/*
 * A sum of products of Chebyshev polynomials, the last coordinate fastest: Clenshaw's recurrence, a coordinate at a time.
 */
static double series(const double *coefficients, const int *size, const double *scaled)
{
    double work[$work];
    const double *from = coefficients;
    for (int j = $last; j >= 0; --j) {
        int rows = 1;
        for (int i = 0; i < j; ++i)
            rows *= size[i];
        for (int r = 0; r < rows; ++r) {
            const double *row = from + r * size[j];
            double b1 = 0.0, b2 = 0.0;
            for (int k = size[j] - 1; k > 0; --k) {
                const double b = row[k] + 2.0 * scaled[j] * b1 - b2;
                b2 = b1;
                b1 = b;
            }
            work[r] = row[0] + scaled[j] * b1 - b2;
        }
        from = work;
    }
    return work[0];
}
""")
PART = Template("""void $name(const double state[$n], double image[$m])
{
$lines
$images
}
""")
COEFFICIENTS = Template("""    static const int size[$n] = {$size};
    static const double coefficients[$m][$total] = {
$rows
    };
    const double scaled[$n] = {
$scaled
    };""")
FUNCTIONS = {
    "sign": "(double x)\n{\n    return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : x;\n}\n",
    "min": "(double x, double y)\n{\n    return isnan(x) || x < y ? x : y;\n}\n",
    "max": "(double x, double y)\n{\n    return isnan(x) || x > y ? x : y;\n}\n",
}  #: that C does not have, or that take what is not real for a number
ANGLES = """#define TWO_PI 6.283185307179586

/* The angle brought to [0, 2 pi). */
static double wrap(double angle)
{
    double wrapped = fmod(angle, TWO_PI) + 0.0; /* -0.0 is 0.0 */
    if (wrapped < 0.0)
        wrapped += TWO_PI;
    return wrapped >= TWO_PI ? 0.0 : wrapped;
}

/* The angle on the turn nearest to the middle. */
static double near(double angle, double middle)
{
    return angle - TWO_PI * rint((angle - middle) / TWO_PI);
}
"""
PIECES = Template("""$angles
int $name(const double state[$n], double image[$m])
{
$seen
    int piece = -1;
    if ($finite) {
        $tests
    }
    switch (piece) {
$cases
    default:
        break;
    }
    if (piece < 0 || $overflow) {
$none
    }
    return piece;
}
""")


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The header and the source, by file name."""
    program = program_of(result, name, about)
    pieces = program.kind == "pieces"
    n, m = len(program.inputs), len(program.outputs)
    sizes = [part.tensor.shape[1:] for part in program.parts if part.polymap.variables is None]
    body, parts = _pieces(program) if pieces else _chain(program), "\n".join(_part(program, part) for part in program.parts)
    header = HEADER.substitute(
        about="\n".join(f" * {line}".rstrip() for line in "\n".join(program.about).rstrip().replace("*/", "* /").split("\n")),
        guard=f"{name.upper()}_H",
        what="Image of a state." + (" Returns the number of its piece, from 0, or -1 where there is none." if pieces else ""),
        returns="int" if pieces else "void",
        name=name,
        n=n,
        m=m,
        pieces=", int *pieces" if pieces else "",
        pieces_about=", pieces (count,) or NULL" if pieces else "",
        parts="\n".join(
            f"void {name}_{p.name}(const double state[{n}], double image[{m}]); /* {p.title} */" for p in program.parts
        ),
    )
    call = f"\n        {name}(states + {n} * k, images + {m} * k);"
    kept = f"        const int piece = {name}(states + {n} * k, images + {m} * k);"
    source = SOURCE.substitute(
        functions="\n".join(f"static double real_{f}{text}" for f, text in FUNCTIONS.items() if f"real_{f}(" in body + parts),
        title=program.title,
        name=name,
        series=SERIES.substitute(work=max(math.prod(size[:-1]) for size in sizes), last=n - 1) if sizes else "",
        parts=parts,
        main=body,
        pieces=", int *pieces" if pieces else "",
        call=f" {{\n{kept}\n        if (pieces)\n            pieces[k] = piece;\n    }}" if pieces else call,
    )
    return {f"{name}.h": header, f"{name}.c": source}


def _part(program: Program, part: Part) -> str:
    """The function of one polynomial map."""
    if part.polymap.variables is None:
        tensor = part.tensor
        values = [f"series(coefficients[{i}], size, scaled)" for i in range(part.outputs)]
        lines = COEFFICIENTS.substitute(
            n=len(program.inputs),
            m=part.outputs,
            size=", ".join(map(str, tensor.shape[1:])),
            total=math.prod(tensor.shape[1:]),
            rows="\n".join(f"        {{{', '.join(map(repr, row.ravel().tolist()))}}}," for row in tensor),
            scaled="\n".join(f"        {x}," for x in scaled_inputs(part, C)),
        )
    else:
        formulas, values = lines_of(part, C)
        lines = "\n".join(f"    const double {name} = {value};" for name, value in formulas)
    return PART.substitute(
        name=f"{program.name}_{part.name}",
        n=len(program.inputs),
        m=part.outputs,
        lines=lines,
        images="\n".join(f"    image[{i}] = {image};" for i, image in enumerate(images_of(part, C, values))),
    )


def _chain(program: Program) -> str:
    """The map that applies its parts one after the other; parameters are handed on."""
    n, m = len(program.inputs), len(program.outputs)
    handed = ", ".join(f"state[{j}]" for j in range(n))
    steps = [f"    {program.name}_{part.name}(x, image);" for part in program.parts]
    carried = "\n".join(f"    x[{i}] = image[{i}];" for i in range(m))
    lines = f"\n{carried}\n".join(steps)
    head = f"void {program.name}(const double state[{n}], double image[{m}])"
    return f"{head}\n{{\n    {'' if len(steps) > 1 else 'const '}double x[{n}] = {{{handed}}};\n{lines}\n}}\n"


def _pieces(program: Program) -> str:
    """The composite map: regions in order, and the piece of the first that holds."""
    n, m = len(program.inputs), len(program.outputs)
    tests = [
        f"if ({C.condition(part.region, program.variables)})\n            piece = {k}; /* {part.title} */"
        for k, part in enumerate(program.parts)
        if part.region is not None
    ]
    return PIECES.substitute(
        angles=ANGLES if program.inputs.angles.any() else "",
        name=program.name,
        n=n,
        m=m,
        seen="\n".join(f"    const double {x} = {value};" for x, value in seen_by_regions(program, C)),
        finite=admissible(program, C),
        tests="\n        else ".join(tests),
        cases="\n".join(_case(program, part, k) for k, part in enumerate(program.parts)),
        overflow=" || ".join(f"!isfinite(image[{i}])" for i in range(m)),
        none="\n".join(f"        image[{i}] = NAN;" for i in range(m)),
    )


def _case(program: Program, part: Part, k: int) -> str:
    turns = [f"        {line};" for line in wrapped_angles(program, C)]
    start = f"        const double x[{len(program.inputs)}] = {{{starts_of(part, C)}}};"
    call = [start, f"        {program.name}_{part.name}(x, image);"]
    return "\n".join([f"    case {k}: {{", *call, *turns, "        break;", "    }"])
