"use strict"
/* The exact return surfaces to be turned by hand, with the map of the page over them. */
function drawSurfaces(box, image, fitted, chosen) {
    const names = DATA.coordinates, shown = DATA.surfaces.map(each => ({
        type: "mesh3d", name: each.name, x: each.states[0], y: each.states[1], z: each.images[image],
        i: each.triangles[0], j: each.triangles[1], k: each.triangles[2], color: each.colour, opacity: 0.75, showlegend: true,
        text: each.words.map((word, k) => `${names[0]} = ${each.states[0][k]}, ${names[1]} = ${each.states[1][k]}<br>`
            + `${word}: ${names.map((name, c) => `${name}' = ${each.images[c][k]}`).join(", ")}`),
        hoverinfo: "text+name", lighting: {ambient: 0.65, diffuse: 0.6},
    }))
    shown.push({
        type: "scatter3d", mode: "markers", name: "composite map", x: fitted.map(row => row[0]), y: fitted.map(row => row[1]),
        z: fitted.map(row => row[2 + image]), marker: {size: 1.6, color: "#D55E00"}, hoverinfo: "skip",
    })
    const axis = name => ({title: {text: name}})
    const layout = {
        margin: {l: 0, r: 0, t: 0, b: 0}, legend: {x: 0, y: 1}, uirevision: "kept",
        scene: {xaxis: axis(names[0]), yaxis: axis(names[1]), zaxis: axis(names[image] + "'"), uirevision: "kept"},
    }
    Plotly.react(box, shown, layout, {responsive: true, displaylogo: false}).then(() => {
        if (box.listens) return
        box.listens = true
        box.on("plotly_click", event => chosen([event.points[0].x, event.points[0].y]))
    })
}
