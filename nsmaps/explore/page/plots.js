"use strict"
/* The pictures of a run, in the colours of the page. */
const diagram = DATA.sweep && openDiagram(DATA.sweep, () => {})
const boxes = DATA.plots.map(plot => {
    const part = document.querySelector("main").appendChild(document.createElement("section"))
    part.className = "wide"
    part.appendChild(document.createElement("h2")).textContent = plot.title
    const box = part.appendChild(document.createElement("div"))
    box.className = "plot"
    return box
})

function drawn() {
    const [ink, paper, line] = ["--ink", "--paper", "--line"].map(themed)
    const inked = each => Object.fromEntries(["marker", "line"].filter(part => each[part]).map(part =>
        [part, {...each[part], color: each[part].color === "#000000" ? ink : each[part].color}]))
    const hovered = each => `%{x}, %{y}${each.z && !each.text ? ": %{z}" : ""}${each.text ? "<br>%{text}" : ""}<extra></extra>`
    DATA.plots.forEach((plot, k) => {
        const look = {color: ink, gridcolor: line, zerolinecolor: line, linecolor: ink, ticks: "outside", mirror: true, showline: true}
        const data = plot.data.map(each => ({...each, ...inked(each), hovertemplate: hovered(each)}))
        Plotly.react(boxes[k], data, {
            margin: {l: 60, r: 20, t: 10, b: 45}, paper_bgcolor: paper, plot_bgcolor: paper, font: {color: ink, family: themed("--type")}, legend: {orientation: "h", y: 1.12},
            xaxis: {...plot.layout.xaxis, ...look}, yaxis: {...plot.layout.yaxis, ...look}, uirevision: "kept", hovermode: "closest",
        }, {responsive: true, displaylogo: false, showSendToCloud: false})
        parted(k)
    })
}

/* Ticks at parts of pi on the axes that are angles, for the range that is shown. */
function parted(k) {
    const {layout, _fullLayout} = boxes[k], update = {}
    for (const [c, side] of [[0, "xaxis"], [1, "yaxis"]]) {
        const found = DATA.plots[k].angles[c] ? ticks(..._fullLayout[side].range, 6, true) : []
        const texts = found.map(each => each.text)
        if (String(texts) !== String(layout[side].ticktext || []))
            Object.assign(update, {[`${side}.tickvals`]: found.map(each => each.value), [`${side}.ticktext`]: texts})
    }
    if (Object.keys(update).length) Plotly.relayout(boxes[k], update)
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    diagram?.look(diagram.view, 0)
    drawn()
})
window.addEventListener("resize", () => diagram?.draw())
drawn()
boxes.forEach((box, k) => box.on("plotly_relayout", () => parted(k)))
