"use strict"
/* A frame with axes on a canvas, in pixels of the screen, for pictures that are drawn anew while something is dragged. */
class Frame {
    /* names of both axes; angles: whether one is an angle, which has ticks at parts of pi */
    constructor(canvas, x, y, names, angles = []) {
        Object.assign(this, {canvas, x, y, names, angles, left: 0, right: 1, top: 0, bottom: 1})
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
        this.pen.font = FONT
        this.heights = ticks(...this.y, Math.max(2, this.height / 60), this.angles[1])
        this.left = 30 + Math.max(...this.heights.map(tick => this.pen.measureText(tick.text).width), 16)
        this.top = 8
        this.right = this.width - 14
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

    contains(x, y) {
        return this.x[0] <= x && x <= this.x[1] && this.y[0] <= y && y <= this.y[1]
    }

    /* A coordinate of an axis to the pixel. */
    digits(value, axis) {
        const [low, high] = axis ? this.y : this.x
        return value.toFixed(Math.max(0, Math.min(15, 3 - Math.floor(Math.log10(high - low)))))
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
        const pen = this.pen, wide = this.right - this.left
        pen.strokeStyle = pen.fillStyle = themed("--ink")
        pen.lineWidth = 1
        pen.font = FONT
        pen.strokeRect(this.left, this.top, wide, this.bottom - this.top)
        pen.textAlign = "center"
        const room = 24 + pen.measureText(ticks(...this.x, 5, this.angles[0])[0]?.text || "").width
        for (const {value, text} of ticks(...this.x, Math.max(1, Math.min(6, wide / room)), this.angles[0])) {
            const [x] = this.at(value, 0)
            pen.fillRect(x, this.bottom, 1, 4)
            pen.fillText(text, Math.min(x, this.width - pen.measureText(text).width / 2), this.bottom + 16)
        }
        pen.fillText(this.names[0], (this.left + this.right) / 2, this.bottom + 32)
        pen.textAlign = "right"
        for (const {value, text} of this.heights) {
            const [, y] = this.at(0, value)
            pen.fillRect(this.left - 4, y, 4, 1)
            pen.fillText(text, this.left - 6, y + 4)
        }
        pen.save()
        pen.translate(14, (this.top + this.bottom) / 2)
        pen.rotate(-Math.PI / 2)
        pen.textAlign = "center"
        pen.fillText(this.names[1], 0, 0)
        pen.restore()
    }
}

const themed = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim()  // a colour or type of the page
const FONT = `12px ${themed("--type")}`

/* About so many ticks: values with their texts, with no more digits than tell them apart; of a wide range of an angle parts of pi. */
function ticks(low, high, count, angle) {
    const unit = angle && high - low > 1 ? Math.PI : 1, rough = (high - low) / unit / count, power = 10 ** Math.floor(Math.log10(rough))
    const steps = unit > 1 ? [1 / 6, 1 / 4, 1 / 3, 1 / 2, 1, 2, 5] : [1, 2, 5, 10].map(each => each * power)
    const step = steps.find(each => each >= rough) || 10, found = []
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9))
    for (let k = Math.ceil(low / unit / step); k * step * unit <= high; ++k)
        found.push({value: k * step * unit, text: unit > 1 ? part(k, Math.round(1 / step) || 1, step) : (k * step).toFixed(Math.min(digits, 20)).replace("-", "\u2212")})
    return found
}

/* k/n pi. */
function part(k, n, step) {
    if (step >= 1) return k ? `${k * step === 1 ? "" : k * step}\u03c0` : "0"
    const common = (a, b) => b ? common(b, a % b) : Math.abs(a), by = common(k, n), above = k / by
    return k ? `${above === 1 ? "" : above === -1 ? "\u2212" : above}\u03c0${n / by > 1 ? `/${n / by}` : ""}` : "0"
}

const short = value => String(Number(value.toPrecision(6)))
const clipped = (value, [low, high]) => Math.min(high, Math.max(low, value))
