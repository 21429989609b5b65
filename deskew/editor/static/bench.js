// The page of `deskew edit`: a photograph to paint materials on, their table, and what came of it.
// It asks (see deskew/editor/talk.py) and shows what it is answered; it keeps nothing that a reload would lose.

const SLIDER = { low: -2, high: 5, step: 0.05 }; // powers of ten [kg/s^2]

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
    this.queue = [];
    this.waiting = null;
    this.urls = {};
    this.find = (selector) => root.querySelector(selector);
    this.painter = new Painter(this);
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
    if (this.painter.idle) this.painter.clear();
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
    this.painter.fit();
    this.showTool();
  }

  showMaterials() {
    const { materials } = this.state;
    const body = this.find("tbody");
    const active = this.root.getRootNode().activeElement;
    const { key, shown } = active?.dataset ?? {};
    this.replacing = true; // a field that goes is not one that is left
    body.replaceChildren(...materials.map((material, i) => this.row(material, i)));
    this.replacing = false;
    const same = key && body.querySelector(`[data-key="${key}"]`);
    if (same) {
      if (shown !== undefined && active.value !== shown) same.value = active.value; // somebody is typing
      same.focus();
    }
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
    this.field(called, name, (value) => ({ name: value }), label);
    called.setAttribute("aria-label", `Name of material ${i + 1}`);
    const [typed, slid] = [find(".number"), find(".slider")];
    this.field(typed, number(stiffness, 6), (value) => ({ stiffness: Number(value) }), label);
    typed.setAttribute("aria-label", `Stiffness of ${name} in kilograms per second squared`);
    slid.value = Math.log10(stiffness);
    slid.setAttribute("aria-label", `Stiffness of ${name}, by powers of ten`);
    slid.setAttribute("aria-valuetext", `${number(stiffness)} kg/s²`);
    slid.oninput = () => { typed.value = typed.dataset.shown = number(10 ** slid.valueAsNumber); };
    slid.onchange = () => this.ask({ do: "change", label, stiffness: Number(number(10 ** slid.valueAsNumber)) });
    find(".remove").onclick = () => this.ask({ do: "remove", label });
    return row;
  }

  field(input, shown, meant, label) {
    input.value = input.dataset.shown = shown;
    const left = () => {
      if (this.replacing || input.value === input.dataset.shown) return;
      input.dataset.shown = input.value;
      this.ask({ do: "change", label, ...meant(input.value) });
    };
    input.addEventListener("change", left);
    input.addEventListener("blur", left);
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
    this.painter.canvas.classList.toggle("moves", this.tool === "move");
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

  wire() {
    const on = (selector, event, act) => this.find(selector).addEventListener(event, act);
    this.root.querySelectorAll("[name=tool]").forEach((input) => {
      input.onchange = () => {
        this.tool = input.value;
        this.painter.giveUp();
        this.showTool();
      };
    });
    for (const name of [".width", ".tolerance", ".opacity"]) on(name, "input", () => this.showTool());
    on(".zoom", "change", () => { this.find(".stack").style.width = `${100 * this.find(".zoom").value}%`; });
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
