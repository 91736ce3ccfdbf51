/* Scripts stand compressed in the page. Each is unpacked once, and run as one of the page's own. */
if (!window.DecompressionStream) {
    const text = "This browser cannot unpack the page. Expected: Chrome 80, Firefox 113, Safari 16.4, or later ones."
    document.querySelector("main").prepend(Object.assign(document.createElement("p"), {textContent: text}))
}
const ran = {}
const unpacked = id => ran[id] ??= (async () => {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), letter => letter.charCodeAt(0))
    const text = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text()
    document.head.append(Object.assign(document.createElement("script"), {text}))
})()
const unpackedInTurn = (...ids) => ids.reduce((before, id) => before.then(() => unpacked(id)), Promise.resolve())
