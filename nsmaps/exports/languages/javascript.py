"""A program as JavaScript, for a page or for node: an object with the functions of a map."""

from collections.abc import Sequence
from string import Template

from nsmaps.exports.conditions import JAVASCRIPT, number
from nsmaps.exports.formulas import lines_of
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
FORMULAS = Template("""/* $title: the image of one state, wherever it is; angles are not wrapped. */
function $name(state) {
$lines
    return [
$images
    ]
}
""")
PART = Template("""const ${name}_coefficients = [
$rows
]

/* $title: the image of one state, wherever it is; angles are not wrapped. */
function $name(state) {
    const size = [$size], scaled = [
$scaled
    ]
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
    if part.polymap.variables is not None:
        return _formulas(part)
    tensor = part.tensor
    rows = [", ".join(repr(float(c)) for c in row.ravel()) for row in tensor]
    scales = zip(part.polymap.centre, part.polymap.scale, strict=True)
    values = [f"series({part.name}_coefficients[{i}], size, scaled)" for i in range(len(tensor))]
    return PART.substitute(
        name=part.name,
        title=part.title.replace("*/", "* /"),
        rows="\n".join(f"    [{row}]," for row in rows),
        size=", ".join(map(str, tensor.shape[1:])),
        scaled="\n".join(f"        (state[{j}] - {number(c)}) / {number(s)}," for j, (c, s) in enumerate(scales)),
        images="\n".join(f"        {f'Math.abs({v})' if a else v}," for v, a in zip(values, part.absolute, strict=True)),
    )


def _formulas(part: Part) -> str:
    """The function of one map with variables."""
    lines, values = lines_of(part, JAVASCRIPT, {name: f"state[{j}]" for j, name in enumerate(part.polymap.coordinates)})
    return FORMULAS.substitute(
        name=part.name,
        title=part.title.replace("*/", "* /"),
        lines="\n".join(f"    const {name} = {value}" for name, value in lines),
        images="\n".join(f"        {f'Math.abs({v})' if a else v}," for v, a in zip(values, part.absolute, strict=True)),
    )


def _chain(program: Program) -> str:
    m = len(program.outputs)
    steps = "\n".join(f"    x = [...{part.name}(x), ...x.slice({m})]" for part in program.parts)
    return CHAIN.substitute(steps=steps, m=m)


def _pieces(program: Program) -> str:
    names, m = program.variables, len(program.outputs)
    angles = program.inputs.angles.tolist()
    seen = [f"wrap(state[{j}])" if angle else f"state[{j}]" for j, angle in enumerate(angles)]
    finite = [f"Number.isFinite({x})" for x in names.values()]
    finite += [f"{number(low)} <= state[{i}] && state[{i}] <= {number(high)}" for i, low, high in program.limits]
    tests = [
        f"    if ({JAVASCRIPT.condition(part.region, names)}) return {k} // {part.title}"
        for k, part in enumerate(program.parts)
        if part.region is not None
    ]
    return PIECES.substitute(
        seen="\n".join(f"    const {x} = {value}" for x, value in zip(names.values(), seen, strict=True)),
        finite=" && ".join(finite),
        tests="\n".join(tests),
        cases="\n".join(_case(part, k, angles[:m]) for k, part in enumerate(program.parts)),
        names=", ".join(f'"{part.name}"' for part in program.parts),
        m=m,
    )


def _case(part: Part, k: int, angles: list[bool]) -> str:
    start = [f"state[{j}]" if middle is None else f"near(state[{j}], {number(middle)})" for j, middle in enumerate(part.middles)]
    turns = [f"        image[{i}] = wrap(image[{i}] + (state[{i}] - x[{i}]))" for i, angle in enumerate(angles) if angle]
    lines = [f"        const x = [{', '.join(start)}]", f"        image = {part.name}(x)", *turns]
    return "\n".join([f"    if (piece === {k}) {{", *lines, "    }"])
