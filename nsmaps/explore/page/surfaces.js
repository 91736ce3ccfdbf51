"use strict"
/* The exact return surfaces to be turned by hand, and the sheets of the composite map over them, a sheet for each piece. */
function drawSurfaces(box, image, shown, rows, points, chosen) {
    const names = DATA.labels, exact = DATA.surfaces.map(each => ({
        type: "mesh3d", name: each.name, x: each.states[0], y: each.states[1], z: each.images[image],
        i: each.triangles[0], j: each.triangles[1], k: each.triangles[2], color: each.colour === "#000000" ? themed("--black") : each.colour, opacity: shown === "both" ? 0.6 : 1, showlegend: true,
        text: each.texts ??= each.words.map((word, k) => described(names.map((_, c) => each.states[c][k]), word, names.map((_, c) => each.images[c][k]))),
        hoverinfo: "text+name", lighting: {ambient: 0.65, diffuse: 0.6},
    }))
    const [i, j, k] = triangles(rows, points, image), heights = rows.filter(row => row[4] >= 0).map(row => row[2 + image])
    const raised = shown === "both" ? 0.01 * heights.reduce((most, each) => Math.max(most, Math.abs(each)), 0) : 0
    const fitted = {
        type: "mesh3d", name: "composite map, by piece", x: rows.map(row => row[0]), y: rows.map(row => row[1]), z: rows.map(row => row[2 + image] + raised),
        i, j, k, vertexcolor: rows.map(row => fills[row[4]] || "#ffffff"), color: themed("--soft"), showlegend: true, flatshading: true,
        text: rows.map(row => row[4] < 0 ? "" : described(row.slice(0, 2), DATA.pieces[row[4]].name, row.slice(2, 4))),
        hoverinfo: "text+name", lighting: {ambient: 0.8, diffuse: 0.4},
    }
    const [ink, paper, line] = ["--ink", "--paper", "--line"].map(themed)
    const axis = name => ({title: {text: name}, gridcolor: line, zerolinecolor: line, backgroundcolor: paper, showbackground: true})
    const layout = {
        margin: {l: 0, r: 0, t: 0, b: 0}, legend: {x: 0, y: 1}, uirevision: "kept", font: {color: ink, family: themed("--type")}, paper_bgcolor: paper,
        scene: {aspectmode: "cube", camera: {eye: {x: 1.45, y: 1.45, z: 1.25}}, xaxis: axis(names[0]), yaxis: axis(names[1]), zaxis: axis(names[image] + "\u2032"), uirevision: "kept"},
    }
    const sheets = {exact, composite: [fitted], both: [...exact, fitted]}[shown]
    Plotly.react(box, sheets, layout, {responsive: true, displaylogo: false, showSendToCloud: false}).then(() => {
        if (box.listens) return
        box.listens = true
        box.on("plotly_click", event => chosen([event.points[0].x, event.points[0].y]))
    })
}

const described = (state, word, images) => DATA.labels.map((name, c) => `${name} = ${short(state[c])}`).join(", ")
    + `<br>${word}: ` + DATA.labels.map((name, c) => `${name}\u2032 = ${short(images[c])}`).join(", ")

/* Triangles over a grid of states: none joins two pieces, nor two ends of the circle. */
function triangles(rows, points, image) {
    const found = [[], [], []]
    const joined = corners => corners.every(n => rows[n][4] === rows[corners[0]][4] && rows[n][4] >= 0
        && !(DATA.angles[image] && Math.abs(rows[n][2 + image] - rows[corners[0]][2 + image]) > Math.PI))
    for (let row = 0; row + 1 < points; ++row)
        for (let column = 0; column + 1 < points; ++column) {
            const first = row * points + column, over = first + points
            for (const corners of [[first, first + 1, over + 1], [first, over + 1, over]])
                if (joined(corners)) corners.forEach((n, c) => found[c].push(n))
        }
    return found
}
