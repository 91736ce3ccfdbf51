"use strict"
/* The bifurcation diagram: the points of the run, and in every rectangle those of the maps of this page, computed in it anew. */
const TRANSIENT = 500, ENOUGH = 150, MOST_RETURNS = 3000, SLICE = 20, KEPT = 20  // returns, milliseconds, views to go back to

class Diagram {
    /* maps: by name {title, colour, at: value => state => [image, piece]}; stored: by name {title, colour, values, states}. */
    constructor(canvas, {stored, events, parameter, labels, angles, start}, maps, set) {
        const shown = [...new Set([...Object.keys(stored), ...Object.keys(maps)])]
        Object.assign(this, {canvas, maps, stored, events, parameter, labels, start, shown, cursor: null, corner: null})
        Object.assign(this, {coordinate: 0, earlier: [], found: {}, held: document.createElement("canvas"), ran: 0})
        const all = shown.length > 1 ? [["all", "all"]] : []
        this.fill("drawn", [...all, ...shown.map(of => [of, this.title(of)])], () => this.compute())
        this.fill("coordinate", labels.map((label, c) => [c, label]), event => this.choose(Number(event.target.value)))
        this.drawn = document.getElementById("drawn")
        this.frame = new Frame(canvas, [0, 1], [0, 1], [parameter.label, labels[0]])
        this.angles = angles
        document.getElementById("back").addEventListener("click", () => this.back())
        document.getElementById("whole").addEventListener("click", () => this.show(this.whole()))
        this.listen(set)
        this.show(this.whole())
        this.earlier = []
    }

    title(of) {
        return (this.maps[of] || this.stored[of]).title
    }

    fill(id, options, changed) {
        const select = document.getElementById(id)
        select.replaceChildren(...options.map(([value, text]) => new Option(text, value)))
        select.addEventListener("change", changed)
    }

    listen(set) {
        const canvas = this.canvas, inside = (x, y) => this.frame.contains(x, y)
        canvas.addEventListener("pointerdown", event => {
            if (!inside(...this.frame.of(event))) return
            canvas.setPointerCapture(event.pointerId)
            this.corner = {from: this.frame.of(event), to: this.frame.of(event), x: event.clientX, y: event.clientY}
        })
        canvas.addEventListener("pointermove", event => {
            const at = this.frame.of(event)
            document.getElementById("pointer").textContent = inside(...at)
                ? `${this.frame.names[0]} = ${this.frame.digits(at[0], 0)}, ${this.frame.names[1]} = ${this.frame.digits(at[1], 1)}` : ""
            if (!this.corner) return
            this.corner.to = at
            this.draw()
        })
        canvas.addEventListener("pointerup", event => {
            if (!this.corner) return
            const {from, x, y} = this.corner, to = this.frame.of(event), moved = [event.clientX - x, event.clientY - y]
            this.corner = null
            if (Math.abs(moved[0]) + Math.abs(moved[1]) < 6) set(from[0])
            else this.show([this.frame.x, this.frame.y].map((range, c) =>  // a side that was hardly dragged stays
                Math.abs(moved[c]) < 6 ? range : [from[c], to[c]].sort((a, b) => a - b).map(value => clipped(value, range))))
        })
        canvas.addEventListener("pointercancel", () => { this.corner = null })
        canvas.addEventListener("dblclick", () => this.show(this.whole()))
        canvas.addEventListener("wheel", event => {
            const at = this.frame.of(event), by = 1.25 ** Math.sign(event.deltaY), whole = this.whole()
            if (!inside(...at) || (by > 1 && this.view.all)) return
            event.preventDefault()
            const [x, y] = [this.frame.x, this.frame.y].map((range, c) => range.map(end =>
                clipped(at[c] + by * (end - at[c]), whole[c])))
            this.show([x, y], 250)
        }, {passive: false})
        canvas.addEventListener("keydown", event => {
            const way = {ArrowLeft: -1, ArrowRight: 1}[event.key]
            if (!way) return
            event.preventDefault()
            set(this.cursor + way * (this.frame.x[1] - this.frame.x[0]) / 400)
        })
    }

    /* The axes that hold all points, of an angle that goes round the circle. */
    whole() {
        const heights = [...Object.values(this.stored), ...Object.values(this.found)].flatMap(each => each.states[this.coordinate])
        const ends = heights.reduce(([low, high], each) => [Math.min(low, each), Math.max(high, each)], [Infinity, -Infinity])
        const [low, high] = heights.length ? ends : [0, 1], room = 0.05 * (high - low || 1)
        return [[this.parameter.low, this.parameter.high], [low - room, high + room]]
    }

    choose(coordinate) {
        this.coordinate = coordinate
        this.named()
        this.show([this.frame.x, this.whole()[1]])
    }

    named() {
        this.frame.names[1] = this.labels[this.coordinate]
        this.frame.angles[1] = this.angles[this.coordinate]
    }

    back() {
        const view = this.earlier.pop()
        if (!view) return
        this.coordinate = view.coordinate
        document.getElementById("coordinate").value = view.coordinate
        this.named()
        this.look(view, 0)
    }

    show([x, y], wait = 0) {
        const whole = this.whole(), all = [x, y].every((range, c) => range[0] <= whole[c][0] && range[1] >= whole[c][1])
        const before = this.view, view = {x, y, coordinate: this.coordinate, all, points: {}, preview: {}, begun: {}}
        for (const of of before ? this.shown : []) {
            view.preview[of] = this.points(of, before)
            view.begun[of] = this.begun(of, view)
        }
        if (before && !this.waits) this.earlier = [...this.earlier.slice(1 - KEPT), before]
        this.look(view, wait)
    }

    look(view, wait) {
        this.view = view
        Object.assign(this.frame, {x: view.x, y: view.y})
        this.paint()
        listEvents(this.events.filter(event => view.x[0] <= event.value && event.value <= view.x[1]))
        clearTimeout(this.waits)
        this.waits = setTimeout(() => {
            this.waits = 0
            this.compute()
        }, wait)
    }

    chosen() {
        return this.shown.filter(of => ["all", of].includes(this.drawn.value))
    }

    /* The points of a map in a view: computed in it, or of the run for all axes, or what was seen of it before. */
    points(of, view = this.view) {
        return view.points[of] || (view.all || !this.maps[of]) && this.stored[of] || view.preview[of] || null
    }

    /* Compute what is drawn and not there, some milliseconds at a time. */
    compute() {
        const view = this.view, run = ++this.ran, there = of => view.points[of]?.done || (view.all && this.stored[of])
        const work = this.chosen().filter(of => this.maps[of] && !there(of)).map(of => this.sweep(of, view))
        const step = () => {
            if (run !== this.ran) return
            const until = performance.now() + SLICE
            while (work.length && performance.now() < until) if (work[0].next().done) work.shift()
            if (work.length) this.add()
            else this.paint()
            if (work.length) setTimeout(step)
        }
        step()
    }

    /* The attractor of a map over the columns of a view, each from the last state of the one at its right. */
    * sweep(of, view) {
        const [low, high] = view.x, columns = Math.round(this.frame.right - this.frame.left), map = this.maps[of]
        const own = state => this.inside(state, view), points = view.points[of] = {values: [], states: this.labels.map(() => []), done: false}
        let from = view.begun[of] || this.start
        for (let column = columns - 1; column >= 0; --column, yield) {
            const value = low + (column + 0.5) / columns * (high - low), image = map.at(value)
            const last = this.follow(image, from, column === columns - 1 ? 10 * TRANSIENT : TRANSIENT) || this.follow(image, this.start, TRANSIENT)
            if (!last) continue
            from = last
            for (let k = 0, seen = 0; k < (seen ? MOST_RETURNS : TRANSIENT) && seen < ENOUGH; ++k) {
                const [next, piece] = image(from)
                if (piece < 0) break
                from = next
                if (own(next)) {
                    ++seen
                    points.values.push(value)
                    next.forEach((each, c) => points.states[c].push(each))
                }
                if (next.every((each, c) => Math.abs(each - last[c]) <= 1e-14 * (1 + Math.abs(each)))) break  // the cycle is closed
            }
        }
        points.done = true
        view.preview[of] = null
        if (view.all) this.found[of] = points
    }

    follow(image, state, count) {
        let now = state
        for (let k = 0; k < count; ++k) {
            const [next, piece] = image(now)
            if (piece < 0) return null
            now = next
        }
        return now
    }

    inside(state, view) {
        const height = state[view.coordinate]
        return view.all || (view.y[0] <= height && height <= view.y[1])
    }

    /* Where a sweep begins: on the attractor that is seen in the rectangle, at the largest value there. */
    begun(of, view) {
        const points = view.preview[of]
        let best = -1
        points?.values.forEach((value, k) => {
            const inside = view.x[0] <= value && value <= view.x[1] && this.inside(points.states.map(line => line[k]), view)
            if (inside && (best < 0 || value > points.values[best])) best = k
        })
        return best < 0 ? null : points.states.map(line => line[best])
    }

    /* The axes and all points, which are kept as a picture until the axes are moved. */
    paint() {
        this.frame.begin()
        this.frame.axes()
        this.held.width = this.canvas.width
        this.held.height = this.canvas.height
        this.held.getContext("2d").drawImage(this.canvas, 0, 0)
        this.painted = {}
        this.add()
    }

    /* The points that have come since. */
    add() {
        const said = [], {frame, held} = this, pen = held.getContext("2d"), scale = held.width / frame.width
        pen.setTransform(scale, 0, 0, scale, 0, 0)
        for (const of of this.chosen()) {
            const points = this.points(of), {colour, title} = this.maps[of] || this.stored[of], own = this.view.points[of]
            if (!points) continue
            const painted = this.painted[of]?.points === points ? this.painted[of] : {points, next: 0, count: 0}
            pen.fillStyle = themed(`--${colour}`)
            for (; painted.next < points.values.length; ++painted.next) {
                const at = [points.values[painted.next], points.states[this.coordinate][painted.next]], [x, y] = frame.at(...at)
                if (!frame.contains(...at)) continue
                pen.fillRect(x - 0.6, y - 0.6, 1.2, 1.2)
                ++painted.count
            }
            this.painted[of] = painted
            const state = points === own ? "computed in this page" : points === this.stored[of] ? "of the run" : "seen before"
            said.push(`<span><i style="background: var(--${colour})"></i>${title}: ${painted.count} states ${state}${own && !own.done ? " ..." : ""}</span>`)
        }
        document.getElementById("maps").innerHTML = said.join(" ")
        this.draw()
    }

    draw() {
        const box = this.canvas.getBoundingClientRect()
        if (Math.abs(box.width - this.frame.width) > 1 || Math.abs(box.height - this.frame.height) > 1) return this.paint()
        this.frame.begin()
        this.frame.pen.drawImage(this.held, 0, 0, this.frame.width, this.frame.height)
        const [low, high] = this.frame.y, tick = high - 0.05 * (high - low)
        const upright = (value, end, colour, width) => this.frame.line([[value, end], [value, high]], colour, width)
        this.frame.inside(pen => {
            for (const event of this.events) upright(event.value, tick, themed("--event"), 1.5)
            if (this.cursor !== null) upright(this.cursor, low, themed("--accent"), 1.5)
            if (!this.corner) return
            const [x0, y0] = this.frame.at(...this.corner.from), [x1, y1] = this.frame.at(...this.corner.to)
            pen.strokeStyle = themed("--accent")
            pen.strokeRect(x0, y0, x1 - x0, y1 - y0)
        })
    }
}

const listEvents = events => {
    document.getElementById("events").innerHTML = events.map(event => `<span>${event.kind} at ${event.value.toFixed(8)}</span>`).join(" ")
}

/* The diagram of a page, with the maps that the page has. */
function openDiagram(sweep, set) {
    const maps = {}
    if (typeof nsmaps_exact !== "undefined") maps.exact = {title: sweep.exact, colour: "points", at: value => nsmaps_exact.at(value).image_of}
    if (sweep.moves) maps.composite = {title: "composite map", colour: "composite", at: value => state => nsmaps_map.image_of([...state, value])}
    return new Diagram(document.getElementById("diagram"), sweep, maps, set)
}
