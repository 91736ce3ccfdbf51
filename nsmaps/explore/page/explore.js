"use strict"
const RETURNS = 2000, FINE = 90, COARSE = 45, SHARP = 240, byId = id => document.getElementById(id)
const names = DATA.labels, moved = DATA.parameter, window_ = DATA.window
const state = {value: moved ? clipped(DATA.parameters[moved.name], [moved.low, moved.high]) : null, start: [...DATA.start]}
const withValue = point => state.value === null ? point : [...point, state.value]
const image = point => nsmaps_map.image_of(withValue(point))

/* The orbit of the composite map from the start: states and pieces, until it leaves the domain of the map. */
function orbit(count = RETURNS) {
    const states = [state.start], pieces = []
    for (let k = 0; k < count; ++k) {
        const [next, piece] = image(states[k])
        pieces.push(piece)
        if (piece < 0) break
        states.push(next)
    }
    return {states, pieces, ended: states.length <= count}
}

/* The least number of returns after which the last states repeat, at most 32; 0 where there is none. */
function period(states) {
    const last = states.slice(-65), close = (a, b) => names.every((_, c) => {
        const gap = Math.abs(a[c] - b[c])
        return (DATA.angles[c] ? Math.min(gap, 2 * Math.PI - gap) : gap) < 1e-6 * Math.max(1, Math.abs(a[c]))
    })
    for (let q = 1; q <= 32 && last.length === 65; ++q)
        if (last.every((each, k) => k < q || close(each, last[k - q]))) return q
    return 0
}

/* The middles of so many cells along either side of the window. */
const cells = points => Array.from({length: points * points}, (_, n) => [n % points, Math.floor(n / points)].map((k, c) =>
    window_[c][0] + (k + 0.5) / points * (window_[c][1] - window_[c][0])))

/* Images over the window: rows [x, y, images ..., piece]. */
const sampled = points => cells(points).map(at => {
    const [next, piece] = image(at)
    return [...at, ...next, piece]
})

const tinted = colour => {
    const part = k => Math.round(0.6 * parseInt(colour.slice(k, k + 2), 16) + 0.4 * 255)
    return `rgb(${part(1)}, ${part(3)}, ${part(5)})`
}
const fills = DATA.colours.map(tinted)
const plane = new Frame(byId("plane"), ...window_, names, DATA.angles)
const cobwebs = names.map((name, c) =>
    new Frame(byId("cobweb" + c), window_[c], window_[c], [`${name}(k)`, `${name}(k + 1)`], [DATA.angles[c], DATA.angles[c]]))
const motion = new Motion(byId("motion"), byId("word"), DATA.motion)

function drawPlane(points, path) {
    const paper = themed("--paper")
    plane.begin()
    plane.inside(pen => {
        const [wide, high] = [plane.right - plane.left, plane.bottom - plane.top].map(side => side / points)
        cells(points).forEach((at, n) => {
            const piece = nsmaps_map.piece_of(withValue(at)), [x, y] = plane.at(...at)
            pen.fillStyle = piece < 0 ? paper : fills[piece]
            pen.fillRect(Math.floor(x - wide / 2), Math.floor(y - high / 2), Math.ceil(wide) + 1, Math.ceil(high) + 1)
        })
        plane.dots(path.states, "#222", 1.6)
        if (!path.ended) plane.dots(path.states.slice(-40), "#CC79A7", 3.5, "#000")
        plane.dots([state.start], "#fff", 5, "#000")
    })
    plane.axes()
}

function drawCobweb(c, rows, path) {
    const frame = cobwebs[c]
    frame.begin()
    frame.inside(pen => {
        pen.globalAlpha = 0.5
        for (const row of rows)
            if (row[row.length - 1] >= 0) frame.dots([[row[c], row[2 + c]]], fills[row[row.length - 1]], 1.3)
        pen.globalAlpha = 1
        frame.line([[frame.x[0], frame.x[0]], [frame.x[1], frame.x[1]]], "#888")
        const steps = states => states.slice(1).flatMap((next, k) => [[states[k][c], next[c]], [next[c], next[c]]])
        const draw = (states, colour, width) => frame.line([[states[0][c], states[0][c]], ...steps(states)], colour, width)
        if (path.states.length > 1) draw(path.states.slice(0, 60), themed("--ink"), 0.8)
        if (!path.ended) draw(path.states.slice(-40), "#CC79A7", 1.8)
        frame.dots([[state.start[c], state.start[c]]], "#fff", 4.5, "#000")
    })
    frame.axes()
}

let asked = false, refined = 0, flown = false, seen = false, due = null
/* Draw all that depends on parameter and start: coarsely while something is dragged, finely when it rests. */
function refresh() {
    if (asked) return
    asked = true
    requestAnimationFrame(() => {
        asked = false
        draw(COARSE)
        clearTimeout(refined)
        refined = setTimeout(() => draw(FINE, true), 180)
    })
}

function draw(points, all = false) {
    const rows = sampled(points), path = orbit()
    drawPlane(all ? SHARP : COARSE, path)
    names.forEach((_, c) => drawCobweb(c, rows, path))
    const q = path.ended ? 0 : period(path.states)
    const found = path.ended ? `the orbit leaves the domain of the map after ${path.states.length - 1} returns`
        : q ? `period ${q} of the composite map` : "no period up to 32 of the composite map"
    byId("motion-name").textContent = found
    byId("motion-name").dataset.period = path.ended ? -1 : q
    if (moved) byId("shown").textContent = `${moved.label} = ${state.value.toFixed(6)}`
    if (!flown) motion.choose(state.value)
    const near = motion.now.value, from = motion.now.state
    byId("exact").textContent = flown ?
        `The exact ${DATA.shown} from ${names.map((name, c) => `${name} = ${short(from[c])}`).join(", ")}${moved ? ` at ${moved.label} = `
            + short(DATA.parameters[moved.name]) : ""}, the nearest of ${DATA.flights.length} computed with this page.` : near === null ? `The exact ${DATA.shown}, computed with this page.` :
        `The exact ${DATA.shown} on the attractor at ${moved.label} = ${short(near)}, the nearest of ${DATA.motion.length} computed with this page.`
    moveCursor()
    if (!all || !DATA.surfaces.length) return
    due = () => drawSurfaces(byId("surfaces"), Number(byId("image").value), byId("sheets").value, rows, points, fly)
    surface()
}

/* The surfaces are drawn, and plotly.js is read, when they are nearly in sight: what is above them need not wait for them. */
async function surface() {
    if (!seen || !due) return
    await unpacked("plotly")
    due?.()
    due = null
}

/* The exact flight from the state that is nearest to one, where the sides of the window count alike, at the parameter of surfaces. */
function fly(at) {
    if (moved) set(DATA.parameters[moved.name])
    const far = flight => Math.hypot(...flight.state.map((value, c) => (value - at[c]) / (window_[c][1] - window_[c][0])))
    flown = true
    motion.show(DATA.flights.reduce((best, each) => far(each) < far(best) ? each : best))
    state.start = at.map((value, c) => clipped(value, window_[c]))
    refresh()
}

function begin(at) {
    flown = false
    state.start = at.map((value, c) => clipped(value, window_[c]))
    refresh()
}

function set(value) {
    flown = false
    state.value = clipped(value, [moved.low, moved.high])
    byId("value").value = state.value
    refresh()
}

const diagram = DATA.sweep && openDiagram(DATA.sweep, value => DATA.sweep.moves && set(value))
if (!diagram) listEvents(DATA.events)

function moveCursor() {
    if (!DATA.sweep?.moves) return
    diagram.cursor = state.value
    diagram.draw()
}

const given = Object.entries(DATA.parameters).map(([name, value]) => `${name} = ${short(value)}`).join(", ")
byId("about").textContent = `${DATA.system}, ${given}. ${DATA.maps}`
byId("control").hidden = !moved
if (moved) {
    byId("name").textContent = moved.label
    Object.assign(byId("value"), {min: moved.low, max: moved.high, step: (moved.high - moved.low) / 2000, value: state.value})
    byId("value").addEventListener("input", event => set(Number(event.target.value)))
}
DATA.pieces.forEach((piece, k) => {
    const entry = byId("legend").appendChild(document.createElement("span"))
    entry.appendChild(document.createElement("i")).style.background = fills[k]
    entry.append(piece.name + (piece.word ? ` (${piece.word})` : ""))
})
byId("plane").addEventListener("click", event => plane.contains(...plane.of(event)) && begin(plane.of(event)))
byId("plane").addEventListener("keydown", event => {
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key]
    if (!way) return
    event.preventDefault()
    begin(state.start.map((value, c) => value + way[c] * (window_[c][1] - window_[c][0]) / 200))
})
byId("play").addEventListener("click", () => {
    motion.playing = !motion.playing
    byId("play").textContent = motion.playing ? "Pause" : "Play"
})
byId("surfaces-part").hidden = !DATA.surfaces.length
byId("image").replaceChildren(...names.map((name, c) => new Option(`${name}\u2032`, c)))
for (const each of ["image", "sheets"]) byId(each).addEventListener("change", () => draw(FINE, true))
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    if (diagram) diagram.paint()
    draw(FINE, true)
})
window.addEventListener("resize", refresh)
new IntersectionObserver(found => {
    seen = found[found.length - 1].isIntersecting
    surface()
}, {rootMargin: "25%"}).observe(byId("surfaces-part"))
window.addEventListener("beforeprint", () => {
    seen = true
    surface()
})
draw(FINE, true)
