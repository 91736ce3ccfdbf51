"use strict"
/* The bifurcation diagram with a cursor: a click sets the parameter, a dragged rectangle is enlarged, a double click shows all. */
class Diagram {
    constructor(canvas, found, events, name, coordinate, {set, ranged}) {
        const seen = Object.values(found), values = seen.flatMap(each => each.values), heights = seen.flatMap(each => each.states[0])
        const ends = list => list.reduce(([low, high], each) => [Math.min(low, each), Math.max(high, each)], [Infinity, -Infinity])
        const [low, high] = ends(heights), room = 0.05 * (high - low)
        this.whole = [ends(values), [low - room, high + room]]
        this.frame = new Frame(canvas, ...this.whole, [name, coordinate])
        Object.assign(this, {canvas, found, events, ranged, cursor: null, corner: null, held: document.createElement("canvas")})
        canvas.addEventListener("pointerdown", event => {
            canvas.setPointerCapture(event.pointerId)
            this.corner = {from: this.frame.of(event), to: this.frame.of(event), x: event.clientX, y: event.clientY}
        })
        canvas.addEventListener("pointermove", event => {
            if (!this.corner) return
            this.corner.to = this.frame.of(event)
            this.draw()
        })
        canvas.addEventListener("pointerup", event => {
            if (!this.corner) return
            const {from, x, y} = this.corner, to = this.frame.of(event), moved = [event.clientX - x, event.clientY - y]
            this.corner = null
            if (Math.abs(moved[0]) + Math.abs(moved[1]) < 6) set(from[0])
            else this.show([this.frame.x, this.frame.y].map((range, c) =>  // a side that was hardly dragged stays
                Math.abs(moved[c]) < 6 ? range : [Math.min(from[c], to[c]), Math.max(from[c], to[c])]))
        })
        canvas.addEventListener("pointercancel", () => { this.corner = null })
        canvas.addEventListener("dblclick", () => this.show(this.whole))
        canvas.addEventListener("keydown", event => {
            const way = {ArrowLeft: -1, ArrowRight: 1}[event.key]
            if (!way) return
            event.preventDefault()
            set(this.cursor + way * (this.frame.x[1] - this.frame.x[0]) / 400)
        })
        this.show(this.whole)
    }

    show([x, y]) {
        Object.assign(this.frame, {x, y})
        this.paint()
        this.ranged(this.events.filter(event => x[0] <= event.value && event.value <= x[1]), x)
        this.draw()
    }

    /* The points, which are kept as a picture until the axes are moved. */
    paint() {
        this.frame.begin()
        this.frame.inside(pen => {
            for (const [of, {values, states}] of Object.entries(this.found)) {
                pen.fillStyle = {exact: themed("--points"), composite: "rgba(213, 94, 0, .45)"}[of]
                values.forEach((value, k) => {
                    const [px, py] = this.frame.at(value, states[0][k])
                    pen.fillRect(px - 0.6, py - 0.6, 1.2, 1.2)
                })
            }
        })
        this.frame.axes()
        this.held.width = this.canvas.width
        this.held.height = this.canvas.height
        this.held.getContext("2d").drawImage(this.canvas, 0, 0)
    }

    draw() {
        const box = this.canvas.getBoundingClientRect()
        if (Math.abs(box.width - this.frame.width) > 1 || Math.abs(box.height - this.frame.height) > 1) this.paint()
        this.frame.begin()
        this.frame.pen.drawImage(this.held, 0, 0, this.frame.width, this.frame.height)
        const upright = (value, colour, width) => this.frame.line([[value, this.frame.y[0]], [value, this.frame.y[1]]], colour, width)
        this.frame.inside(pen => {
            for (const event of this.events) upright(event.value, themed("--event"), 0.8)
            if (this.cursor !== null) upright(this.cursor, "#D55E00", 2)
            if (!this.corner) return
            const [x0, y0] = this.frame.at(...this.corner.from), [x1, y1] = this.frame.at(...this.corner.to)
            pen.strokeStyle = "#D55E00"
            pen.strokeRect(x0, y0, x1 - x0, y1 - y0)
        })
    }
}
