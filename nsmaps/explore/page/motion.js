"use strict"
/* The exact motion that is nearest to the parameter: walls and ball, or the states of a system with modes, and the word so far. */
class Motion {
    constructor(canvas, word, motions) {
        Object.assign(this, {canvas, word, motions, playing: true, clock: 0, before: null})
        this.choose(motions[0].value)
        requestAnimationFrame(now => this.step(now))
    }

    choose(value) {
        const far = each => value === null ? 0 : Math.abs(each.value - value)
        this.show(this.motions.reduce((best, each) => far(each) < far(best) ? each : best))
    }

    show(motion) {
        if (motion !== this.now && motion.state) this.clock = 0
        this.now = motion
        const seen = Object.values(this.now.bodies).flat().filter(Number.isFinite)
        const low = Math.min(...seen), high = Math.max(...seen), room = 0.08 * (high - low || 1)
        this.range = [low - room, high + room]
    }

    step(now) {
        const end = this.now.time[this.now.time.length - 1]
        if (this.playing && this.before !== null) this.clock = (this.clock + (now - this.before) / 900) % end
        this.before = now
        this.draw()
        requestAnimationFrame(later => this.step(later))
    }

    place(line) {
        const time = this.now.time
        let low = 0, high = time.length - 1
        while (high - low > 1) {
            const middle = (low + high) >> 1
            if (time[middle] <= this.clock) low = middle
            else high = middle
        }
        const share = time[high] > time[low] ? (this.clock - time[low]) / (time[high] - time[low]) : 0
        return line[low] + Math.min(1, Math.max(0, share)) * (line[high] - line[low])
    }

    draw() {
        const scale = window.devicePixelRatio || 1, box = this.canvas.getBoundingClientRect(), pen = this.canvas.getContext("2d")
        if (this.now === this.spelt && (box.bottom < 0 || box.top > innerHeight)) return  // out of sight it stands still
        this.canvas.width = Math.round(box.width * scale)
        this.canvas.height = Math.round(box.height * scale)
        pen.setTransform(scale, 0, 0, scale, 0, 0)
        const across = value => 14 + (value - this.range[0]) / (this.range[1] - this.range[0]) * (box.width - 28)
        const middle = box.height / 2, names = Object.keys(this.now.bodies), walls = this.now.walls
        pen.clearRect(0, 0, box.width, box.height)
        pen.font = "13px system-ui, sans-serif"
        pen.textAlign = "center"
        const places = Object.fromEntries(names.map(name => [name, across(this.place(this.now.bodies[name]))]))
        if (walls.length === 2) {
            const ends = walls.map(name => places[name]).sort((a, b) => a - b)
            pen.fillStyle = themed("--inside")
            pen.fillRect(ends[0], middle - 34, ends[1] - ends[0], 68)
            pen.strokeStyle = themed("--soft")
            pen.strokeRect(ends[0], middle - 34, ends[1] - ends[0], 68)
        }
        names.forEach((name, k) => {
            pen.fillStyle = walls.includes(name) ? themed("--event") : k ? "#009E73" : "#D55E00"
            if (walls.includes(name)) pen.fillRect(places[name] - 3, middle - 38, 6, 76)
            else {
                pen.beginPath()
                pen.arc(places[name], walls.length ? middle : 18 + k * (box.height - 36) / Math.max(names.length - 1, 1), 9, 0, 7)
                pen.fill()
            }
            pen.fillStyle = themed("--ink")
            if (walls.includes(name)) pen.fillText(name, places[name], middle + 54)
            else if (!walls.length) pen.fillText(name, places[name] + 22, 22 + k * (box.height - 36) / Math.max(names.length - 1, 1))
        })
        const met = this.now.at.filter(time => time <= this.clock).length
        if (met !== this.met || this.now !== this.spelt) {
            this.word.innerHTML = this.now.letters.map((letter, k) => `<span${k < met ? ' class="met"' : ""}>${letter}</span>`).join("")
            this.met = met
            this.spelt = this.now
        }
    }
}
