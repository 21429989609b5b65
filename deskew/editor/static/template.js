// What the page of `deskew edit` consists of: its tools, and its elements, empty.

const TOOLS = [
  ["brush", "Brush", "Paint along a path."],
  ["rectangle", "Rectangle", "From one corner to the opposite one."],
  ["polygon", "Polygon", "Click its corners; double-click or Enter closes it."],
  ["similar", "Similar colour", "Click a material: what has its colour around there is painted, writing included."],
  ["move", "Move", "Drag the enlarged photograph."],
];

const TEMPLATE = `
<header>
  <h1></h1>
  <p class="files muted"></p>
</header>
<p class="error" role="alert" hidden></p>
<div class="columns">
  <section class="painting" aria-label="Materials on the photograph">
    <h2>Where each material lies</h2>
    <div class="bar" role="radiogroup" aria-label="Tool">
      ${TOOLS.map(([id, name], i) => `<label class="tool"><input type="radio" name="tool" value="${id}" ${i ? "" : "checked"}><span>${name}</span></label>`).join("")}
    </div>
    <p class="hint muted"></p>
    <div class="bar">
      <label class="for-brush">Brush <input class="width" type="range" min="2" max="200" value="40"><output class="width-out"></output></label>
      <label class="for-similar" hidden>Tolerance <input class="tolerance" type="range" min="1" max="100" value="20"><output class="tolerance-out"></output></label>
      <label>Tint <input class="opacity" type="range" min="0" max="100" value="45" aria-label="Tint: opacity of the materials' colours"></label>
      <label>Enlarge <select class="zoom" aria-label="Enlarge the photograph">${[1, 2, 3, 4, 6, 8].map((n) => `<option value="${n}">${n} ×</option>`).join("")}</select></label>
    </div>
    <div class="frame">
      <div class="stack">
        <img class="photograph" alt="The page as it was photographed">
        <img class="overlay" alt="">
        <canvas tabindex="0" role="application" aria-label="Photograph to paint on" aria-describedby="keys"></canvas>
      </div>
    </div>
    <p class="place muted" aria-live="polite"></p>
    <details>
      <summary>By keyboard or by numbers</summary>
      <p id="keys">On the photograph: arrow keys move the cross (with Shift by single pixels), Space paints: it puts the brush
        down and lifts it, sets a corner, or picks a colour. Enter closes a polygon, Escape gives it up. Anywhere: Ctrl+Z
        undoes, Ctrl+Shift+Z does again, Ctrl+S saves the map.</p>
      <form class="numbers bar">
        <label>Points x,y [px] <input class="points" type="text" placeholder="120,80 300,80 300,200" autocomplete="off"></label>
        <button type="submit">Paint with the tool</button>
      </form>
    </details>
    <h2>Materials</h2>
    <table>
      <thead><tr><th scope="col">Paint with</th><th scope="col">Stiffness k<sub>s</sub> [kg/s²]</th><th scope="col">Lies on</th><th scope="col"><span class="hidden">Remove</span></th></tr></thead>
      <tbody></tbody>
    </table>
    <div class="bar">
      <button class="add">Add a material</button>
      <button class="leaf">Find the darker leaf</button>
      <span class="gap"></span>
      <button class="undo">Undo</button>
      <button class="redo">Redo</button>
    </div>
    <label class="free"><input class="free-scale" type="checkbox"> The softer of two materials may have shrunk or grown</label>
    <p class="muted">What kept its size should be the stiffer one, by 10 to 1000 times. Only ratios count, not the numbers themselves.</p>
  </section>
  <section class="results" aria-label="What came of it">
    <h2>What comes of it</h2>
    <figure class="restored">
      <figcaption><strong>Restored page</strong> <span class="busy muted"></span>
        <span class="choice"><label class="light-of">Light <select class="light"></select></label>
        <button class="blink" aria-pressed="false">Show the last one</button></span></figcaption>
      <img class="restored-image" alt="The restored page">
    </figure>
    <div class="pair">
      <figure>
        <figcaption><strong>Difference</strong> to the last one</figcaption>
        <img class="difference" alt="Difference to the last restored page" hidden>
        <p class="none muted">Change a stiffness: what it does to the page is shown here.</p>
        <div class="scale" hidden><div class="ramp"></div><div class="ticks"></div></div>
      </figure>
      <figure>
        <figcaption><strong>Strain</strong> of the page</figcaption>
        <img class="strain" alt="Strain of each quad of the mesh">
        <div class="scale"><div class="ramp"></div><div class="ticks"></div></div>
      </figure>
    </div>
    <dl class="figures"></dl>
    <div class="bar save">
      <button class="save-map primary">Save the map</button>
      <button class="save-restored">Save the restored page</button>
      <span class="said" role="status"></span>
    </div>
  </section>
</div>`;
