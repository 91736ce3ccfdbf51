"""A program as JavaScript, for a page or for node: an object with the functions of a map."""

from collections.abc import Sequence
from string import Template

from nsmaps.exports.conditions import JAVASCRIPT
from nsmaps.exports.formulas import admissible, images_of, lines_of, scaled_inputs, seen_by_regions, starts_of, wrapped_angles
from nsmaps.exports.program import Exportable, Part, Program, program_of

SCRIPT = Template("""/*
$about

    const $name = require("./$name.js")  // or by a script element of a page
    $name.$call
*/
const $name = (() => {
"use strict"

/* A sum of products of Chebyshev polynomials, the last coordinate fastest: Clenshaw's recurrence, a coordinate at a time. */
const work = new Float64Array($work)
function series(coefficients, size, scaled) {
    let from = coefficients, rows = coefficients.length
    for (let j = size.length - 1; j >= 0; --j) {
        rows /= size[j]
        for (let r = 0; r < rows; ++r) {
            const row = r * size[j]
            let b1 = 0, b2 = 0
            for (let k = size[j] - 1; k > 0; --k) {
                const b = from[row + k] + 2 * scaled[j] * b1 - b2
                b2 = b1
                b1 = b
            }
            work[r] = from[row] + scaled[j] * b1 - b2
        }
        from = work
    }
    return work[0]
}

$parts
$main
})()
if (typeof module !== "undefined") module.exports = $name
""")
PART = Template("""$coefficients/* $title: the image of one state, wherever it is; angles are not wrapped. */
function $name(state) {
$lines
    return [
$images
    ]
}
""")

CHAIN = Template("""/* The image of one state. */
function image_of(state) {
    let x = [...state]
$steps
    return x.slice(0, $m)
}

return {image_of, images: states => states.map(image_of)}""")
PIECES = Template("""const TWO_PI = 2 * Math.PI

/* The angle brought to [0, 2 pi). */
function wrap(angle) {
    let wrapped = angle % TWO_PI + 0
    if (wrapped < 0) wrapped += TWO_PI
    return wrapped >= TWO_PI ? 0 : wrapped
}

/* The angle on the turn nearest to the middle, which is even where two are equally near. */
function near(angle, middle) {
    const turns = (angle - middle) / TWO_PI, whole = Math.round(turns)
    return angle - TWO_PI * (whole - turns === 0.5 && whole % 2 !== 0 ? whole - 1 : whole)
}

/* The number of the first piece whose region holds a state, from 0, or -1 where there is none. */
function piece_of(state) {
$seen
    if (!($finite)) return -1
$tests
    return -1
}

/* The image of one state and the number of its piece; NaN and -1 where there is none. */
function image_of(state) {
    const piece = piece_of(state)
    let image
$cases
    if (image === undefined || !image.every(Number.isFinite)) image = Array($m).fill(NaN)
    return [image, piece]
}

return {image_of, piece_of, names: [$names], images: states => states.map(state => image_of(state))}""")


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The script, by file name."""
    program = program_of(result, name, about)
    pieces = program.kind == "pieces"
    plain = [part.tensor for part in program.parts if part.polymap.variables is None]
    answer = "[image, number of its piece]" if pieces else "image"
    text = SCRIPT.substitute(
        about="\n".join(program.about).rstrip().replace("*/", "* /"),
        name=program.name,
        call=f"image_of(state)  // {answer}; state: an array of {len(program.inputs)} numbers; images(states): of many",
        work=max([1, *(tensor[0].size // tensor.shape[-1] for tensor in plain)]),
        parts="\n".join(_part(part) for part in program.parts),
        main=_pieces(program) if pieces else _chain(program),
    )
    return {f"{program.name}.js": text}


def _part(part: Part) -> str:
    """The function of one polynomial map."""
    coefficients = ""
    if part.polymap.variables is None:
        rows = "\n".join(f"    [{', '.join(map(repr, row.ravel().tolist()))}]," for row in part.tensor)
        coefficients = f"const {part.name}_coefficients = [\n{rows}\n]\n\n"
        values = [f"series({part.name}_coefficients[{i}], size, scaled)" for i in range(part.outputs)]
        scaled = "\n".join(f"        {x}," for x in scaled_inputs(part, JAVASCRIPT))
        lines = f"    const size = [{', '.join(map(str, part.tensor.shape[1:]))}], scaled = [\n{scaled}\n    ]"
    else:
        formulas, values = lines_of(part, JAVASCRIPT)
        lines = "\n".join(f"    const {name} = {value}" for name, value in formulas)
    return PART.substitute(
        coefficients=coefficients,
        name=part.name,
        title=part.title.replace("*/", "* /"),
        lines=lines,
        images="\n".join(f"        {image}," for image in images_of(part, JAVASCRIPT, values)),
    )


def _chain(program: Program) -> str:
    m = len(program.outputs)
    steps = "\n".join(f"    x = [...{part.name}(x), ...x.slice({m})]" for part in program.parts)
    return CHAIN.substitute(steps=steps, m=m)


def _pieces(program: Program) -> str:
    tests = [
        f"    if ({JAVASCRIPT.condition(part.region, program.variables)}) return {k} // {part.title}"
        for k, part in enumerate(program.parts)
        if part.region is not None
    ]
    return PIECES.substitute(
        seen="\n".join(f"    const {x} = {value}" for x, value in seen_by_regions(program, JAVASCRIPT)),
        finite=admissible(program, JAVASCRIPT, "Number.isFinite"),
        tests="\n".join(tests),
        cases="\n".join(_case(program, part, k) for k, part in enumerate(program.parts)),
        names=", ".join(f'"{part.name}"' for part in program.parts),
        m=len(program.outputs),
    )


def _case(program: Program, part: Part, k: int) -> str:
    turns = [f"        {line}" for line in wrapped_angles(program, JAVASCRIPT)]
    lines = [f"        const x = [{starts_of(part, JAVASCRIPT)}]", f"        image = {part.name}(x)", *turns]
    return "\n".join([f"    if (piece === {k}) {{", *lines, "    }"])
