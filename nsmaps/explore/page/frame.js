"use strict"
/* A frame with axes on a canvas, in pixels of the screen, for pictures that are drawn anew while something is dragged. */
class Frame {
    constructor(canvas, x, y, names) {
        Object.assign(this, {canvas, x, y, names})
    }

    begin() {
        const scale = window.devicePixelRatio || 1, box = this.canvas.getBoundingClientRect()
        this.width = box.width
        this.height = box.height
        this.canvas.width = Math.round(box.width * scale)
        this.canvas.height = Math.round(box.height * scale)
        this.pen = this.canvas.getContext("2d")
        this.pen.setTransform(scale, 0, 0, scale, 0, 0)
        this.pen.clearRect(0, 0, this.width, this.height)
        this.left = 52
        this.top = 8
        this.right = this.width - 10
        this.bottom = this.height - 38
    }

    at(x, y) {
        return [this.left + (x - this.x[0]) / (this.x[1] - this.x[0]) * (this.right - this.left),
                this.bottom - (y - this.y[0]) / (this.y[1] - this.y[0]) * (this.bottom - this.top)]
    }

    of(event) {
        const box = this.canvas.getBoundingClientRect()
        return [this.x[0] + (event.clientX - box.left - this.left) / (this.right - this.left) * (this.x[1] - this.x[0]),
                this.y[0] + (this.bottom - event.clientY + box.top) / (this.bottom - this.top) * (this.y[1] - this.y[0])]
    }

    inside(draw) {
        this.pen.save()
        this.pen.beginPath()
        this.pen.rect(this.left, this.top, this.right - this.left, this.bottom - this.top)
        this.pen.clip()
        draw(this.pen)
        this.pen.restore()
    }

    line(points, colour, width = 1) {
        const pen = this.pen
        pen.strokeStyle = colour
        pen.lineWidth = width
        pen.beginPath()
        points.forEach((point, k) => k ? pen.lineTo(...this.at(...point)) : pen.moveTo(...this.at(...point)))
        pen.stroke()
    }

    dots(points, colour, radius, edge) {
        const pen = this.pen
        pen.fillStyle = colour
        for (const point of points) {
            pen.beginPath()
            pen.arc(...this.at(...point), radius, 0, 7)
            pen.fill()
            if (edge) {
                pen.strokeStyle = edge
                pen.lineWidth = 1.2
                pen.stroke()
            }
        }
    }

    axes() {
        const pen = this.pen
        pen.strokeStyle = pen.fillStyle = themed("--ink")
        pen.lineWidth = 1
        pen.strokeRect(this.left, this.top, this.right - this.left, this.bottom - this.top)
        pen.font = "12px system-ui, sans-serif"
        pen.textAlign = "center"
        for (const value of ticks(...this.x)) {
            const [x] = this.at(value, 0)
            pen.fillRect(x, this.bottom, 1, 4)
            pen.fillText(short(value), x, this.bottom + 16)
        }
        pen.fillText(this.names[0], (this.left + this.right) / 2, this.bottom + 32)
        pen.textAlign = "right"
        for (const value of ticks(...this.y)) {
            const [, y] = this.at(0, value)
            pen.fillRect(this.left - 4, y, 4, 1)
            pen.fillText(short(value), this.left - 6, y + 4)
        }
        pen.save()
        pen.translate(12, (this.top + this.bottom) / 2)
        pen.rotate(-Math.PI / 2)
        pen.textAlign = "center"
        pen.fillText(this.names[1], 0, 0)
        pen.restore()
    }
}

function ticks(low, high) {
    const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough))
    const step = [1, 2, 5, 10].find(each => each * power >= rough) * power, found = []
    for (let k = Math.ceil(low / step); k * step <= high; ++k) found.push(k * step)
    return found
}

const themed = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim()  // a colour of the page
const short = value => String(Number(value.toPrecision(6)))
const clipped = (value, [low, high]) => Math.min(high, Math.max(low, value))
