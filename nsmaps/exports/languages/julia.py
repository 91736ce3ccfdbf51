"""A program as a Julia module."""

from collections.abc import Sequence
from string import Template

from nsmaps.exports.conditions import JULIA
from nsmaps.exports.formulas import admissible, images_of, lines_of, scaled_inputs, seen_by_regions, starts_of, wrapped_angles
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
PART = Template("""$coefficients"$title: the image of one state, wherever it is; angles are not wrapped."
function $name(state)
$lines
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
    """The function of one polynomial map."""
    coefficients = ""
    if part.polymap.variables is None:
        rows = (f"    [{', '.join(map(repr, row.ravel().tolist()))}],\n" for row in part.tensor)
        table = f"{part.name.upper()}_COEFFICIENTS"
        coefficients = f"const {table} = [\n{''.join(rows)}]\n\n"
        values = [f"series({table}[{i}], size, scaled)" for i in range(1, part.outputs + 1)]
        scaled = "".join(f"        {x},\n" for x in scaled_inputs(part, JULIA))
        lines = f"    size = ({', '.join(map(str, part.tensor.shape[1:]))},)\n    scaled = (\n{scaled}    )"
    else:
        formulas, values = lines_of(part, JULIA)
        lines = "\n".join(f"    {name} = {value}" for name, value in formulas)
    return PART.substitute(
        coefficients=coefficients,
        name=part.name,
        title=_quoted(part.title),
        lines=lines,
        images="\n".join(f"        {image}," for image in images_of(part, JULIA, values)),
    )


def _quoted(title: str) -> str:
    return title.replace("\\", "\\\\").replace("$", "\\$").replace('"', "'")


def _chain(program: Program) -> str:
    m = len(program.outputs)
    steps = "\n".join(f"    x[1:{m}] = {part.name}(x)" for part in program.parts)
    return CHAIN.substitute(name=program.name, steps=steps, m=m)


def _pieces(program: Program) -> str:
    tests = [
        f"    {JULIA.condition(p.region, program.variables)} && return {k}"
        for k, p in enumerate(program.parts, 1)
        if p.region is not None
    ]
    return PIECES.substitute(
        name=program.name,
        seen="\n".join(f"    {x} = {value}" for x, value in seen_by_regions(program, JULIA)),
        finite=f"({admissible(program, JULIA)})",
        tests="\n".join(tests),
        cases="\n".join(_case(program, part, k) for k, part in enumerate(program.parts, 1)),
        m=len(program.outputs),
    )


def _case(program: Program, part: Part, k: int) -> str:
    turns = [f"        {line}" for line in wrapped_angles(program, JULIA)]
    finite = "        all(isfinite, image) && return (image, piece)"
    lines = [f"        x = [{starts_of(part, JULIA)}]", f"        image = {part.name}(x)", *turns, finite]
    return "\n".join([f"    if piece == {k}", *lines, "    end"])
