"""A program as a Julia module."""

from collections.abc import Sequence
from string import Template

from nsmaps.exports.conditions import JULIA, number
from nsmaps.exports.formulas import lines_of
from nsmaps.exports.program import Exportable, Part, Program, program_of

MODULE = Template('''"""
$about

    using .$module
    $results = $module.$name(states)  # states: one row a state, $n columns
"""
module $module

export $name

const TWO_PI = 6.283185307179586

"A sum of products of Chebyshev polynomials, the last coordinate fastest: Clenshaw's recurrence, a coordinate at a time."
function series(coefficients, size, scaled)
    work = copy(coefficients)
    rows = length(work)
    for j in length(size):-1:1
        rows = div(rows, size[j])
        for r in 1:rows
            before = (r - 1) * size[j]
            b1, b2 = 0.0, 0.0
            for k in size[j]:-1:2
                b1, b2 = work[before + k] + 2.0 * scaled[j] * b1 - b2, b1
            end
            work[r] = work[before + 1] + scaled[j] * b1 - b2
        end
    end
    return work[1]
end

$reals$parts
$main
end
''')
FORMULAS = Template(""""$title: the image of one state, wherever it is; angles are not wrapped."
function $name(state)
$lines
    return [
$images
    ]
end
""")
PART = Template("""const ${upper}_COEFFICIENTS = [
$rows
]

"$title: the image of one state, wherever it is; angles are not wrapped."
function $name(state)
    size = ($size,)
    scaled = (
$scaled
    )
    return [
$images
    ]
end
""")
CHAIN = Template(""""The image of one state."
function image_of(state)
    x = collect(Float64, state)
$steps
    return x[1:$m]
end

"The images of states, one row a state."
function $name(states::AbstractMatrix)
    images = Matrix{Float64}(undef, size(states, 1), $m)
    for row in axes(states, 1)
        images[row, :] = image_of(states[row, :])
    end
    return images
end
""")
REALS = """real_sin(x) = isfinite(x) ? sin(x) : NaN
real_cos(x) = isfinite(x) ? cos(x) : NaN
real_tan(x) = isfinite(x) ? tan(x) : NaN
real_asin(x) = abs(x) <= 1 ? asin(x) : NaN
real_acos(x) = abs(x) <= 1 ? acos(x) : NaN
real_sqrt(x) = x < 0 ? NaN : sqrt(x)
real_log(x) = x < 0 ? NaN : log(x)
real_power(x, y) = x < 0 && !isinteger(y) ? NaN : Float64(x)^y

"""  # functions that are not real everywhere
PIECES = Template(""""The angle brought to [0, 2 pi)."
function wrap(angle)
    wrapped = mod(angle, TWO_PI)
    return wrapped >= TWO_PI ? 0.0 : wrapped
end

"The angle on the turn nearest to the middle."
near(angle, middle) = angle - TWO_PI * round((angle - middle) / TWO_PI)

"The number of the first piece whose region holds a state, from 1, or 0 where there is none."
function piece_of(state)
$seen
    $finite || return 0
$tests
    return 0
end

"The image of one state and the number of its piece; NaN and 0 where there is none."
function image_of(state)
    piece = piece_of(state)
$cases
    return fill(NaN, $m), piece
end

"The images of states, one row a state, and the numbers of their pieces."
function $name(states::AbstractMatrix)
    images = Matrix{Float64}(undef, size(states, 1), $m)
    pieces = Vector{Int}(undef, size(states, 1))
    for row in axes(states, 1)
        images[row, :], pieces[row] = image_of(states[row, :])
    end
    return images, pieces
end
""")


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The module, by file name."""
    program = program_of(result, name, about)
    module = "".join(word.capitalize() for word in program.name.split("_"))
    parts = "\n".join(_part(part) for part in program.parts)
    main = _pieces(program) if program.kind == "pieces" else _chain(program)
    text = MODULE.substitute(
        about="\n".join(program.about).rstrip().replace("\\", "\\\\").replace("$", "\\$").replace('"', "'"),
        module=module,
        name=program.name,
        n=len(program.inputs),
        results="images, pieces" if program.kind == "pieces" else "images",
        reals=REALS if "real_" in main + parts else "",
        parts=parts,
        main=main,
    )
    return {f"{program.name}.jl": text}


def _part(part: Part) -> str:
    if part.polymap.variables is not None:
        return _formulas(part)
    tensor = part.tensor
    rows = [", ".join(repr(float(c)) for c in row.ravel()) for row in tensor]
    scales = zip(part.polymap.centre, part.polymap.scale, strict=True)
    values = [f"series({part.name.upper()}_COEFFICIENTS[{i}], size, scaled)" for i in range(1, len(tensor) + 1)]
    return PART.substitute(
        upper=part.name.upper(),
        name=part.name,
        title=_quoted(part.title),
        rows="\n".join(f"    [{row}]," for row in rows),
        size=", ".join(map(str, tensor.shape[1:])),
        scaled="\n".join(f"        (state[{j}] - {number(c)}) / {number(s)}," for j, (c, s) in enumerate(scales, 1)),
        images="\n".join(f"        {f'abs({v})' if a else v}," for v, a in zip(values, part.absolute, strict=True)),
    )


def _formulas(part: Part) -> str:
    """The function of one map with variables."""
    places = {name: f"state[{j}]" for j, name in enumerate(part.polymap.coordinates, 1)}
    lines, values = lines_of(part, JULIA, places)
    return FORMULAS.substitute(
        name=part.name,
        title=_quoted(part.title),
        lines="\n".join(f"    {name} = {value}" for name, value in lines),
        images="\n".join(f"        {f'abs({v})' if a else v}," for v, a in zip(values, part.absolute, strict=True)),
    )


def _quoted(title: str) -> str:
    return title.replace("\\", "\\\\").replace("$", "\\$").replace('"', "'")


def _chain(program: Program) -> str:
    m = len(program.outputs)
    steps = "\n".join(f"    x[1:{m}] = {part.name}(x)" for part in program.parts)
    return CHAIN.substitute(name=program.name, steps=steps, m=m)


def _pieces(program: Program) -> str:
    names, m = program.variables, len(program.outputs)
    angles = program.inputs.angles.tolist()
    seen = [f"wrap(state[{j}])" if angle else f"state[{j}]" for j, angle in enumerate(angles, 1)]
    finite = [f"isfinite({x})" for x in names.values()]
    finite += [f"{number(low)} <= state[{i + 1}] <= {number(high)}" for i, low, high in program.limits]
    tests = [
        f"    {JULIA.condition(p.region, names)} && return {k}" for k, p in enumerate(program.parts, 1) if p.region is not None
    ]
    return PIECES.substitute(
        name=program.name,
        seen="\n".join(f"    {x} = {value}" for x, value in zip(names.values(), seen, strict=True)),
        finite=f"({' && '.join(finite)})",
        tests="\n".join(tests),
        cases="\n".join(_case(part, k, angles[:m]) for k, part in enumerate(program.parts, 1)),
        m=m,
    )


def _case(part: Part, k: int, angles: list[bool]) -> str:
    start = [
        f"state[{j}]" if middle is None else f"near(state[{j}], {number(middle)})" for j, middle in enumerate(part.middles, 1)
    ]
    turns = [f"        image[{i}] = wrap(image[{i}] + (state[{i}] - x[{i}]))" for i, angle in enumerate(angles, 1) if angle]
    finite = "        all(isfinite, image) && return (image, piece)"
    lines = [f"        x = [{', '.join(start)}]", f"        image = {part.name}(x)", *turns, finite]
    return "\n".join([f"    if piece == {k}", *lines, "    end"])
