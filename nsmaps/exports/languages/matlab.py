"""A program as a MATLAB function file, for many states at once; GNU Octave runs it too."""

from collections.abc import Sequence
from string import Template

from nsmaps.exports.conditions import MATLAB, number
from nsmaps.exports.formulas import admissible, images_of, lines_of, scaled_inputs, seen_by_regions, wrapped_angles
from nsmaps.exports.program import Exportable, Part, Program, program_of

WIDE = 8  #: coefficients a line

FILE = Template("""function $results = $name(states)
$about
%
%   $results = $name(states), states: one row a state, $n columns
$main
end$reals

function value = series(coefficients, sizes, scaled)
% Sums of products of Chebyshev polynomials, the last coordinate fastest: Clenshaw's recurrence, a coordinate at a time.
    value = repmat(coefficients, size(scaled, 1), 1);
    rows = numel(coefficients);
    for j = numel(sizes):-1:1
        rows = rows / sizes(j);
        before = (0:rows - 1) * sizes(j);
        x = scaled(:, j);
        b1 = zeros(size(scaled, 1), rows);
        b2 = b1;
        for k = sizes(j):-1:2
            b = value(:, before + k) + 2 * x .* b1 - b2;
            b2 = b1;
            b1 = b;
        end
        value = value(:, before + 1) + x .* b1 - b2;
    end
end

$parts""")
PART = Template("""function image = $name(states)
% $title: images wherever the states are; angles are not wrapped.
$lines
    image = zeros(size(states, 1), $m);
$images
end
""")
PIECES = Template("""    images = nan(size(states, 1), $m);
    pieces = zeros(size(states, 1), 1);
$seen
    left = $finite;
$tests
$cases
end

function wrapped = wrap(angle)
% The angle brought to [0, 2 pi).
    wrapped = angle + 0;
    out = angle < 0 | angle >= 2 * pi;  % of others, mod takes those next to 2 pi for it
    wrapped(out) = mod(angle(out), 2 * pi);
    wrapped(wrapped >= 2 * pi) = 0;
end

function angle = near(angle, middle)
% The angle on the turn nearest to the middle, halves to even.
    turns = (angle - middle) / (2 * pi);
    whole = round(turns);
    half = abs(turns - fix(turns)) == 0.5;
    whole(half) = 2 * round(turns(half) / 2);
    angle = angle - 2 * pi * whole;""")
REALS = """

function value = real_sqrt(x)
    value = sqrt(max(x, 0));
    value(x < 0) = NaN;
end

function value = real_log(x)
    value = log(max(x, 0));
    value(x < 0) = NaN;
end

function value = real_asin(x)
    value = asin(max(min(x, 1), -1));
    value(~(abs(x) <= 1)) = NaN;
end

function value = real_acos(x)
    value = acos(max(min(x, 1), -1));
    value(~(abs(x) <= 1)) = NaN;
end

function value = real_min(x, y)
    value = min(x, y);  % which ignores what is not real
    value(isnan(x) | isnan(y)) = NaN;
end

function value = real_max(x, y)
    value = -real_min(-x, -y);
end

function value = real_power(x, y)
    none = x < 0 & y ~= fix(y);
    base = x .* ones(size(none));
    base(none) = NaN;  % one complex power makes all of them complex, and 0 ^ 0 no number
    value = base .^ y;
end"""  # functions that are not real everywhere


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The function file, by file name."""
    program = program_of(result, name, about)
    about = "\n".join(f"%   {line}".rstrip() for line in "\n".join(program.about).rstrip().split("\n"))
    parts = "\n".join(_part(part) for part in program.parts)
    main = _pieces(program) if program.kind == "pieces" else _chain(program)
    text = FILE.substitute(
        results="[images, pieces]" if program.kind == "pieces" else "images",
        name=program.name,
        about=about.replace("%   ", f"%{program.name.upper()} ", 1),
        n=len(program.inputs),
        main=main,
        reals=REALS if "real_" in main + parts else "",
        parts=parts,
    )
    return {f"{program.name}.m": text}


def _part(part: Part) -> str:
    """The function of one polynomial map."""
    if part.polymap.variables is None:
        values = [f"series([ ...\n{_listed(row.ravel().tolist())}], sizes, scaled)" for row in part.tensor]
        scaled = ", ...\n".join(f"        {x}" for x in scaled_inputs(part, MATLAB, "states"))
        lines = f"    sizes = [{', '.join(map(str, part.tensor.shape[1:]))}];\n    scaled = [ ...\n{scaled}\n    ];"
    else:
        formulas, values = lines_of(part, MATLAB, "states")
        lines = "\n".join(f"    {name} = {value};" for name, value in formulas)
    images = zip(MATLAB.entries("image", part.outputs), images_of(part, MATLAB, values), strict=True)
    return PART.substitute(
        name=part.name,
        title=part.title,
        m=part.outputs,
        lines=lines,
        images="\n".join(f"    {name} = {image};" for name, image in images),
    )


def _listed(values: list[float]) -> str:
    rows = [", ".join(map(repr, values[k : k + WIDE])) for k in range(0, len(values), WIDE)]
    return ", ...\n".join(f"            {row}" for row in rows)


def _chain(program: Program) -> str:
    m = len(program.outputs)
    steps = "\n".join(f"    states(:, 1:{m}) = {part.name}(states);" for part in program.parts)
    return f"{steps}\n    images = states(:, 1:{m});"


def _pieces(program: Program) -> str:
    tests = [
        f"    holds = left & {MATLAB.condition(p.region, program.variables)};  % {p.title}\n"
        f"    pieces(holds) = {k};\n    left = left & ~holds;"
        for k, p in enumerate(program.parts, 1)
        if p.region is not None
    ]
    return PIECES.substitute(
        m=len(program.outputs),
        seen="\n".join(f"    {x} = {value};" for x, value in seen_by_regions(program, MATLAB, "states")),
        finite=admissible(program, MATLAB, state="states"),
        tests="\n".join(tests),
        cases="\n".join(_case(program, part, k) for k, part in enumerate(program.parts, 1)),
    )


def _case(program: Program, part: Part, k: int) -> str:
    near = [f"    x(:, {j}) = near(start(:, {j}), {number(c)});" for j, c in enumerate(part.middles, 1) if c is not None]
    turns = [f"    {line};" for line in wrapped_angles(program, MATLAB, "start")]
    lost = "    image(any(~isfinite(image), 2), :) = NaN;"
    head = [f"    rows = pieces == {k};", "    start = states(rows, :);", "    x = start;"]
    return "\n".join([*head, *near, f"    image = {part.name}(x);", *turns, lost, "    images(rows, :) = image;"])
