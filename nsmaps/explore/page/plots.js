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
    })
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    diagram?.look(diagram.view, 0)
    drawn()
})
window.addEventListener("resize", () => diagram?.draw())
drawn()
