// What a tool is doing is drawn here at once, over the photograph; what it covers is decided by the desk.

class Painter {
  constructor(bench) {
    this.bench = bench;
    this.canvas = bench.find("canvas");
    this.path = []; // places on the photograph, in its own pixels
    this.wire();
  }

  get idle() {
    return !this.path.length;
  }

  giveUp() {
    this.path = [];
    this.clear();
  }

  fit() {
    const [width, height] = this.bench.state.size;
    const share = Math.min(1, 1800 / Math.max(width, height));
    const size = [Math.round(width * share), Math.round(height * share)];
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) [this.canvas.width, this.canvas.height] = size;
    this.bench.find(".stack").style.aspectRatio = `${width} / ${height}`;
    this.cross ??= [width / 2, height / 2];
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    const [width, height] = this.bench.state.size;
    return [((event.clientX - box.left) / box.width) * width - 0.5, ((event.clientY - box.top) / box.height) * height - 0.5];
  }

  clear() {
    this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (this.crossed) this.drawCross();
  }

  drawn([x, y]) {
    const share = this.canvas.width / this.bench.state.size[0];
    return [(x + 0.5) * share, (y + 0.5) * share];
  }

  draw() {
    const pen = this.canvas.getContext("2d");
    this.clear();
    const material = this.bench.state.materials.find(({ label }) => label === this.bench.label);
    pen.strokeStyle = pen.fillStyle = material === this.bench.state.materials[0] ? "#fff" : css(material.colour);
    pen.globalAlpha = 0.7;
    pen.lineCap = pen.lineJoin = "round";
    pen.lineWidth = this.bench.tool === "brush" ? this.bench.find(".width").valueAsNumber * (this.canvas.width / this.bench.state.size[0]) : 2;
    const places = this.path.map((place) => this.drawn(place));
    if (!places.length) return;
    pen.beginPath();
    if (this.bench.tool === "rectangle") {
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
    const few = { brush: 1, rectangle: 2, polygon: 3, similar: 1 }[this.bench.tool];
    this.path = [];
    if (!few || points.length < few) return this.clear();
    const rounded = points.map((place) => place.map((value) => Math.round(value * 10) / 10));
    const [width, tolerance] = [this.bench.find(".width").valueAsNumber, this.bench.find(".tolerance").valueAsNumber];
    this.bench.ask({ do: "paint", tool: this.bench.tool, label: this.bench.label, points: rounded, width, tolerance });
  }

  pressed(event) {
    if (this.bench.tool === "move" || event.button || !this.bench.state) return;
    this.crossed = false;
    const place = this.at(event);
    if (this.bench.tool === "similar") return this.paint([place]);
    if (this.bench.tool === "polygon") {
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
    const ends = this.bench.tool === "rectangle" ? [this.path[0], this.path.at(-1)] : this.path;
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
      const [width, height] = this.bench.state.size;
      const by = event.shiftKey ? 1 : Math.max(1, Math.round(width / 50));
      this.cross = [
        Math.min(width - 1, Math.max(0, Math.round(this.cross[0] + by * step[0]))),
        Math.min(height - 1, Math.max(0, Math.round(this.cross[1] + by * step[1]))),
      ];
      this.crossed = true;
      if (this.path.length && this.bench.tool === "brush") this.path.push(this.cross);
      this.drawKeyed();
      this.follow();
      this.bench.find(".place").textContent = `Cross at x ${Math.round(this.cross[0])}, y ${Math.round(this.cross[1])} px`;
    } else if (event.key === " ") {
      this.crossed = true;
      if (this.bench.tool === "similar") this.paint([this.cross]);
      else if (this.path.length && this.bench.tool !== "polygon") this.paint([...this.path, this.cross]);
      else if (this.bench.tool !== "move") {
        this.path.push(this.cross);
        this.drawKeyed();
      }
    } else if (event.key === "Enter") this.paint();
    else if (event.key === "Escape") this.giveUp();
    else return;
    event.preventDefault();
  }

  follow() {
    const frame = this.bench.find(".frame");
    const share = this.canvas.clientWidth / this.bench.state.size[0];
    const [x, y] = this.cross.map((value) => value * share);
    const kept = (start, length, place) => Math.min(Math.max(start, place - 0.9 * length), place - 0.1 * length);
    frame.scrollLeft = kept(frame.scrollLeft, frame.clientWidth, x);
    frame.scrollTop = kept(frame.scrollTop, frame.clientHeight, y);
  }

  drawKeyed() {
    const ends = this.path;
    if (this.bench.tool !== "brush" && ends.length) this.path = [...ends, this.cross];
    this.draw();
    this.path = ends;
    this.drawCross();
  }

  byNumbers() {
    const found = this.bench.find(".points").value.match(/-?\d+(\.\d+)?/g) ?? [];
    const places = [];
    for (let i = 0; i + 1 < found.length; i += 2) places.push([Number(found[i]), Number(found[i + 1])]);
    if (places.length) this.paint(places);
  }

  wire() {
    const on = (event, act) => this.canvas.addEventListener(event, act);
    on("pointerdown", (event) => this.pressed(event));
    on("pointermove", (event) => this.moved(event));
    on("pointerup", () => this.released());
    on("pointercancel", () => this.released());
    on("dblclick", () => this.bench.tool === "polygon" && this.paint());
    on("keydown", (event) => this.bench.state && this.key(event));
    on("blur", () => {
      this.crossed = false;
      if (this.idle) this.clear();
    });
    this.bench.find(".numbers").addEventListener("submit", (event) => {
      event.preventDefault();
      this.byNumbers();
    });
  }
}
