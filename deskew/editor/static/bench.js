// The page of `deskew edit`: a photograph to paint materials on, their table, and what came of it.
// It asks (see deskew/editor/talk.py) and shows what it is answered; it keeps nothing that a reload would lose.

const TOOLS = [
  ["brush", "Brush", "Paint along a path."],
  ["rectangle", "Rectangle", "From one corner to the opposite one."],
  ["polygon", "Polygon", "Click its corners; double-click or Enter closes it."],
  ["similar", "Similar colour", "Click a material: what has its colour around there is painted, writing included."],
  ["move", "Move", "Drag the enlarged photograph."],
];
const SLIDER = { low: -2, high: 5, step: 0.05 }; // powers of ten [kg/s^2]

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

const number = (value, digits = 3) => String(Number(value.toPrecision(digits)));
const css = (colour) => `rgb(${colour.join(",")})`;

class Bench {
  constructor(model, root) {
    this.model = model;
    this.root = root;
    root.className = "bench";
    root.innerHTML = TEMPLATE;
    this.state = null;
    this.label = null;
    this.tool = "brush";
    this.path = [];
    this.queue = [];
    this.waiting = null;
    this.urls = {};
    this.find = (selector) => root.querySelector(selector);
    this.canvas = this.find("canvas");
    this.wire();
    this.received = (content, buffers) => this.answered(content, buffers);
    model.on("msg:custom", this.received);
    this.ask({ do: "open" });
  }

  close() {
    this.model.off("msg:custom", this.received);
    clearTimeout(this.patience);
    Object.values(this.urls).forEach((url) => URL.revokeObjectURL(url));
  }

  // --- asking and being answered, one message at a time ---

  ask(message) {
    const last = this.queue.at(-1);
    // Of several numbers for one material only the newest is worth a solve.
    if (last?.do === "change" && message.do === "change" && last.label === message.label) Object.assign(last, message);
    else this.queue.push({ ...message });
    this.next();
  }

  next() {
    if (this.waiting || !this.queue.length) return;
    this.waiting = { ...this.queue.shift(), id: Math.random().toString(36).slice(2) };
    this.since = performance.now();
    this.find(".busy").textContent = "solving …";
    this.root.setAttribute("aria-busy", "true");
    this.model.send(this.waiting);
    clearTimeout(this.patience);
    this.patience = setTimeout(() => this.complain("No answer yet: does `deskew edit` still run? What is painted is kept."), 20000);
  }

  complain(error) {
    const failed = this.find(".error");
    failed.textContent = error;
    failed.hidden = !error;
  }

  async answered(content, buffers) {
    if (content.id !== this.waiting?.id) return;
    clearTimeout(this.patience);
    const made = this.waiting.do;
    this.state = content;
    const decoded = content.pictures.map((name, i) => this.picture(name, buffers[i]));
    if (!content.pictures.includes("difference")) this.find(".difference").hidden = true;
    this.show();
    await Promise.all(decoded);
    if (!this.path.length) this.clear();
    if (made === "add" && !content.error) this.select(content.materials.at(-1).label);
    this.waiting = null;
    this.find(".busy").textContent = "";
    this.root.setAttribute("aria-busy", "false");
    this.root.dataset.answers = Number(this.root.dataset.answers ?? 0) + 1;
    this.root.dataset.milliseconds = Math.round(performance.now() - this.since);
    this.next();
  }

  async picture(name, buffer) {
    const image = this.find({ restored: ".restored-image" }[name] ?? `.${name}`);
    const photographic = ["photograph", "restored", "last"].includes(name);
    const url = URL.createObjectURL(new Blob([buffer], { type: photographic ? "image/jpeg" : "image/png" }));
    const old = this.urls[name];
    this.urls[name] = url;
    if (image && !(name === "restored" && this.blinking)) image.src = url;
    if (name === "restored" || name === "last") this.blink(false);
    if (image) {
      image.hidden = false;
      await image.decode().catch(() => {});
    }
    if (old) URL.revokeObjectURL(old);
  }

  // --- showing the state ---

  show() {
    const state = this.state;
    this.find("h1").textContent = `Stiffness of ${state.name}`;
    this.find(".files").textContent = `${state.saved ? "Saved in" : "Kept as a draft; to be saved in"} ${state.files.map}`;
    this.complain(state.error);
    this.find(".said").textContent = state.said;
    if (!state.materials.some((material) => material.label === this.label)) this.label = state.materials.at(-1).label;
    this.showMaterials();
    this.find(".undo").disabled = !state.undo;
    this.find(".redo").disabled = !state.redo;
    this.find(".leaf").hidden = !state.can_find_leaf;
    this.find(".blink").disabled = !state.pictures.includes("last");
    this.showLights();
    this.showScales();
    this.showFigures();
    this.fit();
    this.showTool();
  }

  showMaterials() {
    const { materials } = this.state;
    const body = this.find("tbody");
    const focused = this.root.getRootNode().activeElement?.dataset?.key;
    body.replaceChildren(...materials.map((material, i) => this.row(material, i)));
    if (focused) body.querySelector(`[data-key="${focused}"]`)?.focus();
    const lying = materials.filter((material) => material.share > 0);
    const two = lying.length === 2 && lying[0].stiffness !== lying[1].stiffness;
    const free = this.find(".free-scale");
    free.checked = this.state.free_scale;
    free.disabled = !two && !free.checked;
  }

  row(material, i) {
    const row = document.createElement("tr");
    const { label, name, stiffness } = material;
    const ratio = stiffness / this.state.materials[0].stiffness;
    row.innerHTML = `
      <th scope="row"><input type="radio" name="material" data-key="use-${label}">
        <span class="swatch"></span><input class="name" type="text" maxlength="40" data-key="name-${label}"></th>
      <td><input class="number" type="number" min="0" step="any" data-key="number-${label}">
        <input class="slider" type="range" min="${SLIDER.low}" max="${SLIDER.high}" step="${SLIDER.step}" data-key="slider-${label}">
        <span class="muted">${i ? `${number(ratio)} × ${this.escaped(this.state.materials[0].name)}` : "the page's own"}</span></td>
      <td>${number(100 * material.share, 2)} %</td>
      <td><button class="remove" ${i ? "" : "hidden"} aria-label="Remove ${this.escaped(name)}" title="Remove">×</button></td>`;
    const find = (selector) => row.querySelector(selector);
    const use = find("[type=radio]");
    use.checked = label === this.label;
    use.setAttribute("aria-label", `Paint with ${name}`);
    use.onchange = () => this.select(label);
    row.classList.toggle("chosen", use.checked);
    const swatch = find(".swatch");
    if (i) swatch.style.background = css(material.colour);
    const called = find(".name");
    called.value = name;
    called.setAttribute("aria-label", `Name of material ${i + 1}`);
    called.onchange = () => this.ask({ do: "change", label, name: called.value });
    const [typed, slid] = [find(".number"), find(".slider")];
    typed.value = number(stiffness, 6);
    typed.setAttribute("aria-label", `Stiffness of ${name} in kilograms per second squared`);
    slid.value = Math.log10(stiffness);
    slid.setAttribute("aria-label", `Stiffness of ${name}, by powers of ten`);
    slid.setAttribute("aria-valuetext", `${number(stiffness)} kg/s²`);
    typed.onchange = () => this.ask({ do: "change", label, stiffness: typed.valueAsNumber || 0 });
    slid.oninput = () => { typed.value = number(10 ** slid.valueAsNumber); };
    slid.onchange = () => this.ask({ do: "change", label, stiffness: Number(number(10 ** slid.valueAsNumber)) });
    find(".remove").onclick = () => this.ask({ do: "remove", label });
    return row;
  }

  escaped(text) {
    const box = document.createElement("i");
    box.textContent = text;
    return box.innerHTML.replaceAll('"', "&quot;");
  }

  select(label) {
    this.label = label;
    this.showMaterials();
  }

  showLights() {
    const { lights, light } = this.state;
    const choice = this.find(".light");
    choice.replaceChildren(...lights.map((name) => new Option(name, name, name === light, name === light)));
    this.find(".light-of").hidden = lights.length < 2;
  }

  showScales() {
    const { limits, scale } = this.state;
    const parts = [[".difference", limits.difference, "grey levels", "darker", "lighter"], [".strain", limits.strain, "%", "squeezed", "stretched"]];
    for (const [selector, limit, unit, below, above] of parts) {
      const box = this.find(selector).closest("figure").querySelector(".scale");
      box.hidden = this.find(selector).hidden;
      box.querySelector(".ramp").style.background = `linear-gradient(to right, ${scale.map(css).join(", ")})`;
      box.querySelector(".ticks").innerHTML = `<span>−${number(limit)} ${unit}<br>${below}</span><span>0</span><span>+${number(limit)} ${unit}<br>${above}</span>`;
    }
    this.find(".none").hidden = !this.find(".difference").hidden;
  }

  showFigures() {
    const { figures, remedy } = this.state;
    const lines = [["Strain, root mean square", figures.strain_rms_percent, "%"], ["Strain, largest", figures.strain_max_percent, "%"]];
    if ("moved_mean_mm" in figures) {
      lines.push(["Moved since the last one, mean", figures.moved_mean_mm, "mm"], ["… largest", figures.moved_max_mm, "mm"]);
    }
    if ("shrink_estimated" in figures) {
      const shrunk = figures.shrink_estimated;
      lines.push([`The softer material has ${shrunk < 0 ? "grown" : "shrunk"} by`, Math.abs(shrunk), "%"]);
    }
    const cells = lines.map(([name, value, unit]) => `<div><dt>${name}</dt><dd>${value.toFixed(2)} ${unit}</dd></div>`);
    if (remedy) cells.push(`<div><dt>Not at rest</dt><dd>${this.escaped(remedy)}</dd></div>`);
    this.find(".figures").innerHTML = cells.join("");
  }

  showTool() {
    this.find(".hint").textContent = TOOLS.find(([id]) => id === this.tool)[2];
    this.find(".for-brush").hidden = this.tool !== "brush";
    this.find(".for-similar").hidden = this.tool !== "similar";
    this.canvas.classList.toggle("moves", this.tool === "move");
    const width = this.find(".width").valueAsNumber;
    this.find(".width-out").textContent = `${width} px, ${number(width * (this.state?.mm_per_px ?? 0), 2)} mm`;
    this.find(".tolerance-out").textContent = `± ${this.find(".tolerance").value} grey levels`;
    this.find(".overlay").style.opacity = this.find(".opacity").value / 100;
  }

  blink(on) {
    this.blinking = on;
    this.find(".blink").setAttribute("aria-pressed", String(on));
    this.find(".restored-image").src = (on && this.urls.last) || this.urls.restored || "";
  }

  // --- painting: what the tool is doing is drawn here at once, what it covers is decided by the desk ---

  fit() {
    const [width, height] = this.state.size;
    const share = Math.min(1, 1800 / Math.max(width, height));
    const size = [Math.round(width * share), Math.round(height * share)];
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) [this.canvas.width, this.canvas.height] = size;
    this.find(".stack").style.aspectRatio = `${width} / ${height}`;
    this.cross ??= [width / 2, height / 2];
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    const [width, height] = this.state.size;
    return [((event.clientX - box.left) / box.width) * width - 0.5, ((event.clientY - box.top) / box.height) * height - 0.5];
  }

  clear() {
    this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (this.crossed) this.drawCross();
  }

  drawn([x, y]) {
    const share = this.canvas.width / this.state.size[0];
    return [(x + 0.5) * share, (y + 0.5) * share];
  }

  draw() {
    const pen = this.canvas.getContext("2d");
    this.clear();
    const material = this.state.materials.find(({ label }) => label === this.label);
    pen.strokeStyle = pen.fillStyle = material === this.state.materials[0] ? "#fff" : css(material.colour);
    pen.globalAlpha = 0.7;
    pen.lineCap = pen.lineJoin = "round";
    pen.lineWidth = this.tool === "brush" ? this.find(".width").valueAsNumber * (this.canvas.width / this.state.size[0]) : 2;
    const places = this.path.map((place) => this.drawn(place));
    if (!places.length) return;
    pen.beginPath();
    if (this.tool === "rectangle") {
      const [[left, top], [right, bottom]] = [places[0], places.at(-1)];
      pen.fillRect(left, top, right - left, bottom - top);
      return;
    }
    pen.moveTo(...places[0]);
    (places.length > 1 ? places.slice(1) : places).forEach((place) => pen.lineTo(...place));
    pen.stroke();
  }

  drawCross() {
    const pen = this.canvas.getContext("2d");
    const [x, y] = this.drawn(this.cross);
    for (const [colour, width] of [["#000", 5], ["#fff", 2]]) {
      pen.globalAlpha = 1;
      [pen.strokeStyle, pen.lineWidth] = [colour, width];
      pen.beginPath();
      pen.moveTo(x - 14, y);
      pen.lineTo(x + 14, y);
      pen.moveTo(x, y - 14);
      pen.lineTo(x, y + 14);
      pen.stroke();
    }
  }

  paint(points = this.path) {
    const few = { brush: 1, rectangle: 2, polygon: 3, similar: 1 }[this.tool];
    this.path = [];
    if (!few || points.length < few) return this.clear();
    const rounded = points.map((place) => place.map((value) => Math.round(value * 10) / 10));
    const [width, tolerance] = [this.find(".width").valueAsNumber, this.find(".tolerance").valueAsNumber];
    this.ask({ do: "paint", tool: this.tool, label: this.label, points: rounded, width, tolerance });
  }

  pressed(event) {
    if (this.tool === "move" || event.button || !this.state) return;
    this.crossed = false;
    const place = this.at(event);
    if (this.tool === "similar") return this.paint([place]);
    if (this.tool === "polygon") {
      this.path.push(place);
      return this.draw();
    }
    this.canvas.setPointerCapture(event.pointerId);
    this.dragging = true;
    this.path = [place];
    this.draw();
  }

  moved(event) {
    if (!this.dragging) return;
    const events = event.getCoalescedEvents?.() ?? [];
    (events.length ? events : [event]).forEach((one) => this.path.push(this.at(one)));
    this.draw();
  }

  released() {
    if (!this.dragging) return;
    this.dragging = false;
    const ends = this.tool === "rectangle" ? [this.path[0], this.path.at(-1)] : this.path;
    const held = this.path;
    this.paint(ends);
    this.path = held;
    this.draw();
    this.path = []; // stays drawn until the answer comes
  }

  key(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const step = steps[event.key];
    if (step) {
      const [width, height] = this.state.size;
      const by = event.shiftKey ? 1 : Math.max(1, Math.round(width / 50));
      this.cross = [
        Math.min(width - 1, Math.max(0, Math.round(this.cross[0] + by * step[0]))),
        Math.min(height - 1, Math.max(0, Math.round(this.cross[1] + by * step[1]))),
      ];
      this.crossed = true;
      if (this.path.length && this.tool === "brush") this.path.push(this.cross);
      this.drawKeyed();
      this.follow();
      this.find(".place").textContent = `Cross at x ${Math.round(this.cross[0])}, y ${Math.round(this.cross[1])} px`;
    } else if (event.key === " ") {
      this.crossed = true;
      if (this.tool === "similar") this.paint([this.cross]);
      else if (this.path.length && this.tool !== "polygon") this.paint([...this.path, this.cross]);
      else if (this.tool !== "move") {
        this.path.push(this.cross);
        this.drawKeyed();
      }
    } else if (event.key === "Enter") this.paint();
    else if (event.key === "Escape") {
      this.path = [];
      this.clear();
    } else return;
    event.preventDefault();
  }

  follow() {
    const frame = this.find(".frame");
    const share = this.canvas.clientWidth / this.state.size[0];
    const [x, y] = this.cross.map((value) => value * share);
    const kept = (start, length, place) => Math.min(Math.max(start, place - 0.9 * length), place - 0.1 * length);
    frame.scrollLeft = kept(frame.scrollLeft, frame.clientWidth, x);
    frame.scrollTop = kept(frame.scrollTop, frame.clientHeight, y);
  }

  drawKeyed() {
    const ends = this.path;
    if (this.tool !== "brush" && ends.length) this.path = [...ends, this.cross];
    this.draw();
    this.path = ends;
    this.drawCross();
  }

  byNumbers() {
    const found = this.find(".points").value.match(/-?\d+(\.\d+)?/g) ?? [];
    const places = [];
    for (let i = 0; i + 1 < found.length; i += 2) places.push([Number(found[i]), Number(found[i + 1])]);
    if (places.length) this.paint(places);
  }

  wire() {
    const on = (selector, event, act) => this.find(selector).addEventListener(event, act);
    this.root.querySelectorAll("[name=tool]").forEach((input) => {
      input.onchange = () => {
        this.tool = input.value;
        this.path = [];
        this.clear();
        this.showTool();
      };
    });
    for (const name of [".width", ".tolerance", ".opacity"]) on(name, "input", () => this.showTool());
    on(".zoom", "change", () => { this.find(".stack").style.width = `${100 * this.find(".zoom").value}%`; });
    on("canvas", "pointerdown", (event) => this.pressed(event));
    on("canvas", "pointermove", (event) => this.moved(event));
    on("canvas", "pointerup", () => this.released());
    on("canvas", "pointercancel", () => this.released());
    on("canvas", "dblclick", () => this.tool === "polygon" && this.paint());
    on("canvas", "keydown", (event) => this.state && this.key(event));
    on("canvas", "blur", () => { this.crossed = false; if (!this.path.length) this.clear(); });
    on(".numbers", "submit", (event) => { event.preventDefault(); this.byNumbers(); });
    on(".add", "click", () => this.ask({ do: "add" }));
    on(".leaf", "click", () => this.ask({ do: "leaf", label: this.label }));
    on(".undo", "click", () => this.ask({ do: "undo" }));
    on(".redo", "click", () => this.ask({ do: "redo" }));
    on(".save-map", "click", () => this.ask({ do: "save_map" }));
    on(".save-restored", "click", () => this.ask({ do: "save_restored" }));
    on(".light", "change", () => this.ask({ do: "light", light: this.find(".light").value }));
    on(".free-scale", "change", () => this.ask({ do: "free_scale", on: this.find(".free-scale").checked }));
    on(".blink", "click", () => this.blink(!this.blinking));
    this.root.addEventListener("keydown", (event) => this.shortcut(event));
  }

  shortcut(event) {
    event.stopPropagation(); // the notebook around has keys of its own
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    const asked = { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save_map" }[key];
    const typing = event.target.type === "text" || event.target.type === "number";
    if (!asked || (typing && key !== "s")) return;
    event.preventDefault();
    this.ask({ do: asked });
  }
}

export default {
  render({ model, el }) {
    const root = document.createElement("main");
    el.append(root);
    const bench = new Bench(model, root);
    return () => bench.close();
  },
};
