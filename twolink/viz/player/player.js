// The player of twolink: meshcat's viewer, words above it, and buttons below.
//
// It shows films that are in the page (each frame's commands are applied in order, at once), and
// frames that a server sends through a websocket. It asks the network for nothing else.
(function () {
  "use strict";

  const CALM = matchMedia("(prefers-reduced-motion: reduce)");
  const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
  const SIGN = {
    play: '<svg width="14" height="14" viewBox="0 0 14 14"><path d="M3 1.5v11l9.5-5.5z"/></svg>',
    pause: '<svg width="14" height="14" viewBox="0 0 14 14"><path d="M2.5 1.5h3v11h-3zM8.5 1.5h3v11h-3z"/></svg>',
    view: '<svg width="14" height="14" viewBox="0 0 14 14"><path d="M1 1h4v1.6H2.6V5H1zM9 1h4v4h-1.6V2.6H9zM1 9h1.6v2.4H5V13H1zM11.4 9H13v4H9v-1.6h2.4z"/></svg>',
  };

  // --- input --------------------------------------------------------------------------------

  async function inflated(base64) {
    const bytes = Uint8Array.from(atob(base64.trim()), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }

  // A message: the length of its JSON (four bytes), the JSON, and the commands that it counts.
  function unpacked(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    let place = 4 + length;
    const cut = (lengths) =>
      lengths.map((size) => {
        const command = new Uint8Array(buffer, place, size);
        place += size;
        return command;
      });
    return { head, cut };
  }

  // --- one picture --------------------------------------------------------------------------

  class Stage {
    constructor(element, about) {
      this.about = about;
      this.element = element;
      this.pane = element.querySelector(".pane");
      this.canvas = element.querySelector(".words");
      this.viewer = new MeshCat.Viewer(this.pane, false);
      // With another camera the viewer takes new controls, and forgets to let go of the first.
      this.viewer.controls.dispose();
      // Pictures that are scaled down have smoother edges.
      this.viewer.renderer.setPixelRatio(element.closest(".bare") ? window.devicePixelRatio || 1 : 1);
      // The viewer would take the height of the window, and stretch an orthographic camera.
      this.viewer.set_3d_pane_size = () => this.fit();
      this.words = null;
    }

    apply(commands) {
      for (const command of commands) this.viewer.handle_command_bytearray(command);
      if (this.about.recoloured) this.colour();
    }

    // Of a film in one theme a picture in another.
    wear(colours) {
      Object.assign(this.about, { recoloured: null }, colours);
      for (const property of ["top_color", "bottom_color"])
        this.viewer.set_property(["Background"], property, this.about.background);
      this.colour();
      this.viewer.set_dirty();
    }

    // All that is drawn flat; a body's colours are its own in any light.
    colour() {
      this.viewer.scene.traverse(({ material }) => {
        if (!material || !(material.isMeshBasicMaterial || material.isLineBasicMaterial)) return;
        material.userData.own ??= `#${material.color.getHexString()}`;
        const { own } = material.userData;
        material.color.set((this.about.recoloured || {})[own] || own);
      });
    }

    // The rule of twolink/viz/framing.py.
    fit() {
      const width = this.element.clientWidth, height = this.element.clientHeight;
      if (!width || !height || !this.viewer.camera.isOrthographicCamera) return;
      const { framing, box, names, reach } = this.about;
      const fitting = Math.min(width / framing.width, height / framing.height);
      this.unit = Math.min(Math.max(fitting, framing.smallest), framing.largest);
      this.top = this.unit * (framing.top + framing.row * names.length);
      this.bottom = this.unit * framing.bottom;
      const side = this.unit * framing.side;
      const scale = Math.max(1e-9, Math.min(
        (width - 2 * side) / (box[1] - box[0]), (height - this.top - this.bottom) / (box[3] - box[2])));
      const x = (box[0] + box[1]) / 2;
      const y = (box[2] + box[3]) / 2 + (height / 2 - (this.top + height - this.bottom) / 2) / scale;
      const { camera, controls, renderer } = this.viewer;
      Object.assign(camera, {
        left: -width / 2 / scale, right: width / 2 / scale,
        top: height / 2 / scale, bottom: -height / 2 / scale, zoom: 1,
      });
      camera.up.set(0, 1, 0);
      camera.position.set(x, -y, 50 * reach);
      controls.target.set(x, -y, 0);
      camera.updateProjectionMatrix();
      renderer.setSize(width, height);
      const ratio = window.devicePixelRatio || 1;
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
      this.width = width;
      this.height = height;
      this.ratio = ratio;
      this.viewer.set_dirty();
    }

    show(commands, words) {
      this.apply(commands);
      this.words = words;
    }

    draw() {
      if (!this.width) this.fit();
      if (!this.width) return;
      this.viewer.render();
      if (this.words) this.write();
    }

    picture() {
      this.draw();
      const canvas = document.createElement("canvas");
      canvas.width = this.width;
      canvas.height = this.height;
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.imageSmoothingQuality = "high";
      context.drawImage(this.viewer.renderer.domElement, 0, 0, canvas.width, canvas.height);
      context.drawImage(this.canvas, 0, 0, canvas.width, canvas.height);
      return canvas.toDataURL("image/png");
    }

    pixel(x, y) {
      const point = new MeshCat.THREE.Vector3(x, -y, 0).project(this.viewer.camera);
      return [(point.x + 1) / 2 * this.width, (1 - point.y) / 2 * this.height];
    }

    // --- words --------------------------------------------------------------------------------

    write() {
      const c = this.canvas.getContext("2d");
      c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      c.clearRect(0, 0, this.width, this.height);
      c.lineJoin = "round";
      this.place(c, [...this.words.labels, ...this.about.surfaces]);
      this.strips(c);
    }

    font(c, size, weight) {
      const pixels = Math.max(size * this.unit, Math.min(size, 12.5));
      c.font = `${weight || 400} ${pixels}px system-ui, "Segoe UI", Roboto, "DejaVu Sans", Arial, sans-serif`;
      return pixels;
    }

    place(c, labels) {
      const { theme } = this.about;
      const colour = {
        joint: theme.ink, contact: theme.contact, impulse: theme.impulse,
        surface: theme.faint, friction: theme.contact,
      };
      const { camera } = this.viewer;
      const scale = this.height * camera.zoom / (camera.top - camera.bottom);
      // How far a word is from its place, beside its own size: pixels of the bars and hatches.
      const away = {
        joint: 0.9 * this.about.width * scale, contact: 1.3 * this.about.width * scale,
        impulse: 0, surface: 0.8 * this.about.hatch * scale,
        friction: 0.5 * this.about.width * scale + 8 * this.unit,
      };
      const marks = this.marks(scale), taken = [];
      // The labels for which there was no free place.
      this.crowded = [];
      const room = { top: this.top, bottom: this.height - this.bottom, right: this.width };
      for (const [text, x, y, dx, dy, kind, line] of labels) {
        const size = this.font(c, kind === "joint" ? 17 : 14, kind === "surface" ? 400 : 600);
        const half = c.measureText(text).width / 2;
        // The letter of D keeps out of the rings about it.
        let far = text === "D" && kind === "joint" ? 1.4 * this.about.width * scale : away[kind];
        // Behind a joint's letter, line by line.
        if (line) far = away.joint + (6 + 17 * line) * this.unit;
        const wanted = { at: this.pixel(x, y), way: [dx, dy], far, half, size, along: kind === "surface" };
        const { place: [left, middle], covered } = free(wanted, room, marks, taken);
        if (covered) this.crowded.push(text);
        taken.push({ left: left - 2, right: left + 2 * half + 2, top: middle - 0.55 * size, bottom: middle + 0.55 * size });
        c.textAlign = "left";
        c.textBaseline = "middle";
        if (kind === "surface" || kind === "friction") {
          // Hatching would strike the letters through.
          c.fillStyle = theme.background;
          c.fillRect(left - 3, middle - 0.62 * size, 2 * half + 6, 1.24 * size);
        }
        c.lineWidth = 4;
        c.strokeStyle = theme.background;
        c.strokeText(text, left, middle);
        c.fillStyle = colour[kind];
        c.fillText(text, left, middle);
      }
    }

    // Areas that no label may cover, in pixels: marks of this moment, edges of surfaces, and the links.
    marks(scale) {
      const { words, about } = this;
      const found = [...(words.marks || []), ...(about.marks || [])];
      const joints = words.labels.filter(([, , , , , kind]) => kind === "joint");
      for (let k = 1; k < joints.length; k++)
        found.push([joints[k - 1][1], joints[k - 1][2], joints[k][1], joints[k][2], about.width / 2]);
      return found.map(([x, y, endX, endY, radius]) =>
        ({ start: this.pixel(x, y), end: this.pixel(endX, endY), radius: radius * scale }));
    }

    strips(c) {
      const { about, words, unit: u, width, height } = this;
      const { theme } = about;
      const side = about.framing.side * u;
      c.fillStyle = theme.background;
      c.fillRect(0, 0, width, this.top);
      c.fillRect(0, height - this.bottom, width, this.bottom);
      c.textBaseline = "middle";
      // Time at the right, the title in the remaining width.
      const time = `t = ${this.seconds(words.t)}`;
      const size = this.font(c, 18, 600);
      const middle = about.framing.top * u / 2;
      c.textAlign = "right";
      c.fillStyle = theme.ink;
      c.fillText(time, width - side, middle);
      let room = width - 3 * side - c.measureText(`t = ${this.seconds(about.start + about.duration)}`).width;
      // A page with buttons shows the speed between them.
      if (about.speed !== 1 && this.element.closest(".bare")) {
        this.font(c, 14);
        c.fillStyle = theme.faint;
        const speed = `× ${Number(about.speed.toPrecision(3))}`;
        c.fillText(speed, side + room + side / 2, middle);
        room -= c.measureText(speed).width + side;
      }
      this.font(c, 18, 600);
      c.textAlign = "left";
      c.fillStyle = theme.ink;
      c.fillText(this.cut(c, about.title, room), side, middle);
      this.legend(c, side, size);
      this.notes(c, side, this.energy(c, side));
    }

    // A time with as many decimals as tell one frame from the next; a still has those of its time.
    seconds(t) {
      const step = this.about.speed / this.about.fps;
      const needed = Math.max(2, Math.min(9, Math.ceil(-Math.log10(step) - 1e-9)));
      const own = this.about.still === undefined ? 0 : (String(this.about.still).split(".")[1] || "").length;
      return `${t.toFixed(Math.max(needed, Math.min(own, 9)))} s`;
    }

    // Runs by their colours, and how far the end of each is from the first one's.
    legend(c, side) {
      const { about, words, unit: u } = this;
      about.names.forEach((name, k) => {
        const y = (about.framing.top + about.framing.row * (k + 0.35)) * u;
        c.fillStyle = about.swatches[k];
        c.fillRect(side, y - 3 * u, 18 * u, 6 * u);
        this.font(c, 14);
        c.textAlign = "left";
        c.fillStyle = about.theme.ink;
        const apart = k ? `:  ${words.apart[k - 1]}` : "";
        c.fillText(this.cut(c, name + apart, this.width - 3 * side), side + 26 * u, y);
      });
    }

    energy(c, side) {
      const { about, words, unit: u, height } = this;
      const { theme, energy } = about;
      const bar = { x: side, y: height - 24 * u, w: Math.min(this.width * 0.46, 400 * u), h: 10 * u };
      const share = (value) => (energy.most > 0 ? Math.max(0, value) / energy.most : 0);
      const potential = words.V;
      const parts = [
        ["T", words.T, theme.kinetic], ["V above minimum", potential, theme.potential],
        ["dissipated", energy.most - words.T - potential, theme.axis],
      ].slice(0, energy.loses ? 3 : 2);
      c.fillStyle = theme.grid;
      c.fillRect(bar.x, bar.y, bar.w, bar.h);
      let x = bar.x, words_x = bar.x;
      // Where there is no room for the numbers, the names remain.
      let size = this.font(c, 14);
      const wide = (all) => parts.reduce((sum, [name]) =>
        sum + size * 2.1 + c.measureText(all ? `${name} ${joules(energy.most, energy.most)}` : name).width, 0);
      const numbers = wide(true) < this.width - 2 * side;
      const shorten = (name) => (wide(false) < this.width - 2 * side ? name : name.split(" ")[0]);
      for (const [name, value, colour] of parts) {
        size = this.font(c, 14);
        const long = share(value) * bar.w;
        c.fillStyle = colour;
        c.fillRect(x, bar.y, Math.min(long, bar.x + bar.w - x), bar.h);
        x += long;
        c.fillRect(words_x, bar.y - 15 * u - size / 3, size * 0.66, size * 0.66);
        c.textAlign = "left";
        c.fillStyle = theme.ink;
        const text = numbers ? `${name} ${joules(Math.max(value, 0), energy.most)}` : shorten(name);
        const longest = numbers ? `${name} ${joules(energy.most, energy.most)}` : text;
        c.fillText(text, words_x + size, bar.y - 15 * u);
        words_x += size * 2.1 + c.measureText(longest).width;
      }
      return words_x;
    }

    // The contacts, and the grid's spacing, at the right.
    notes(c, side, taken) {
      const { about, words, unit: u, width, height } = this;
      c.textAlign = "right";
      this.font(c, 14);
      c.fillStyle = about.theme.contact;
      const mode = words.mode === "moves freely" ? "" : words.mode;
      const room = width - side - taken;
      if (c.measureText(mode).width <= room) {
        c.fillText(mode, width - side, height - 39 * u);
      } else {
        // Where there is no room beside the energies, above them.
        c.lineWidth = 4;
        c.strokeStyle = about.theme.background;
        const cut = this.cut(c, mode, width - 2 * side);
        c.fillStyle = about.theme.background;
        c.fillRect(width - side - c.measureText(cut).width - 4, height - this.bottom - 18 * u, c.measureText(cut).width + 8, 18 * u);
        c.fillStyle = about.theme.contact;
        c.fillText(cut, width - side, height - this.bottom - 9 * u);
      }
      this.font(c, 13);
      c.fillStyle = about.theme.faint;
      const text = about.grid;
      c.fillText(text, width - side, height - 19 * u);
      const left = width - side - c.measureText(text).width - 22 * u;
      c.strokeStyle = about.theme.faint;
      c.lineWidth = 1;
      c.strokeRect(left + 0.5, height - 24 * u + 0.5, 11 * u, 11 * u);
    }

    cut(c, text, room) {
      if (c.measureText(text).width <= room) return text;
      while (text && c.measureText(text + "…").width > room) text = text.slice(0, -1);
      return text && text + "…";
    }
  }

  // The place nearest to the one wanted at which a word covers no other and no mark: turned about its
  // point, or farther from it; the name of a surface moves along the edge.
  function free(wanted, room, marks, taken) {
    const { half, size } = wanted;
    let best = null;
    for (const [turn, step] of wanted.along ? ALONG : AROUND) {
      let [left, middle] = wanted.along ? beside(wanted, turn) : around(wanted, turn, step * size);
      left = Math.min(Math.max(left, 4), room.right - 2 * half - 4);
      middle = Math.min(Math.max(middle, room.top + size / 2), room.bottom - size / 2);
      const box = { left: left - 2, right: left + 2 * half + 2, top: middle - 0.5 * size, bottom: middle + 0.5 * size };
      const covered = marks.filter((mark) => meets(box, mark)).length
        + 2 * taken.filter((other) => overlap(box, other)).length;
      if (!best || covered < best.covered) best = { covered, place: [left, middle] };
      if (!covered) break;
    }
    return best;
  }

  // Turns (degrees) and steps (sizes of the letters), the least first.
  const AROUND = [0, 0.8, 1.6, 2.4, 3.2]
    .flatMap((step) => [...Array(10).keys()].flatMap((k) => (k ? [[20 * k, step], [-20 * k, step]] : [[0, step]])))
    .sort(([a, b], [c, d]) => Math.abs(a) / 30 + b - Math.abs(c) / 30 - d);
  const ALONG = [...Array(12).keys()].map((k) => [k, 0]);

  function around({ at: [x, y], way: [dx, dy], far, half, size }, turn, step) {
    const angle = turn * Math.PI / 180;
    const [ex, ey] = [dx * Math.cos(angle) - dy * Math.sin(angle), dx * Math.sin(angle) + dy * Math.cos(angle)];
    return [x + ex * (far + step + half + 4) - half, y + ey * (far + step + 0.72 * size)];
  }

  // The name of a surface, shifted along its edge.
  function beside({ at: [x, y], way: [dx, dy], far, half, size }, shift) {
    const level = 1 - Math.abs(dx), upright = 1 - Math.abs(dy);
    return [
      x + dx * (far + half + 4) + level * (half + 8 + shift * (half + 8)) - half,
      y + dy * (far + 0.72 * size) + upright * size * (1 + 1.2 * shift),
    ];
  }

  function overlap(a, b) {
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  }

  // Whether a box meets a line with round ends.
  function meets(box, { start, end, radius }) {
    const grown = { left: box.left - radius, right: box.right + radius, top: box.top - radius, bottom: box.bottom + radius };
    // The part of the line inside the grown box.
    let from = 0, to = 1;
    for (const [at, way, low, high] of [
      [start[0], end[0] - start[0], grown.left, grown.right],
      [start[1], end[1] - start[1], grown.top, grown.bottom],
    ]) {
      if (Math.abs(way) < 1e-9) {
        if (at < low || at > high) return false;
      } else {
        const [a, b] = [(low - at) / way, (high - at) / way];
        from = Math.max(from, Math.min(a, b));
        to = Math.min(to, Math.max(a, b));
      }
    }
    return from <= to;
  }

  // An energy to three digits of the most that there is.
  function joules(value, most) {
    if (!(most > 0)) return "0 J";
    const [unit, size] =
      most >= 2e3 ? ["kJ", 1e3] : most >= 0.1 ? ["J", 1] : most >= 1e-4 ? ["mJ", 1e-3] : ["µJ", 1e-6];
    const decimals = Math.max(0, Math.min(9, 2 - Math.floor(Math.log10(most / size) + 1e-9)));
    return `${(value / size).toFixed(decimals)} ${unit}`;
  }

  // --- films in the page, and streams ---------------------------------------------------------

  // A source calls `shown(frame)` with {commands, words}, and answers to play, pause, seek, speed.
  class InPage {
    constructor(buffer) {
      const { head, cut } = unpacked(buffer);
      this.about = head.about;
      this.setup = cut(head.setup);
      this.frames = head.frames.map(({ words, commands }) => ({ words, commands: cut(commands) }));
      this.state = { playing: false, speed: 1, frame: 0 };
    }

    start(player) {
      this.player = player;
      player.begin(this.about, this.setup);
      this.seek(0);
    }

    get last() { return this.frames.length - 1; }

    seek(frame) {
      this.state.frame = Math.max(0, Math.min(this.last, frame));
      this.shift(this.state.frame);
      this.show();
    }

    show() {
      this.player.show(this.frames[Math.floor(this.state.frame + 1e-9)], this.state);
    }

    play(on) {
      if (on && this.state.frame >= this.last) this.state.frame = 0;
      this.shift(this.state.frame);
      this.state.playing = on;
      this.show();
    }

    speed(value) {
      this.shift(this.state.frame);
      this.state.speed = value;
      this.show();
    }

    // From here and now on the clock counts.
    shift(frame) {
      this.from = { frame, time: performance.now() };
    }

    tick() {
      if (!this.state.playing) return;
      const seconds = (performance.now() - this.from.time) / 1000;
      const frame = this.from.frame + seconds * this.about.fps * this.state.speed;
      const before = Math.floor(this.state.frame + 1e-9);
      this.state.frame = Math.min(frame, this.last);
      if (frame >= this.last) this.state.playing = false;
      if (Math.floor(this.state.frame + 1e-9) !== before || !this.state.playing) this.show();
    }
  }

  class Stream {
    constructor() {
      this.socket = new WebSocket(`ws://${location.host}${location.pathname}stream`);
      this.socket.binaryType = "arraybuffer";
      this.state = { playing: false, speed: 1, frame: 0 };
    }

    start(player) {
      this.socket.onmessage = ({ data }) => {
        const { head, cut } = unpacked(data);
        if (head.about) {
          this.about = head.about;
          player.begin(head.about, cut(head.setup));
        } else {
          this.state = head.state;
          player.show({ words: head.words, commands: cut(head.commands) }, head.state);
        }
      };
      this.socket.onclose = () => player.ended();
    }

    get last() { return this.about.count - 1; }
    ask(question) { if (this.socket.readyState === 1) this.socket.send(JSON.stringify(question)); }
    seek(frame) { this.ask({ seek: frame }); }
    play(on) { this.ask({ play: on }); }
    speed(value) { this.ask({ speed: value }); }
    tick() {}
  }

  // --- the element ----------------------------------------------------------------------------

  class Player {
    constructor(element, source) {
      this.element = element;
      this.source = source;
      // Shown in print, and without WebGL.
      const still = element.querySelector(".still");
      element.innerHTML =
        '<div class="stage"><div class="pane"></div><canvas class="words"></canvas></div>' +
        '<div class="controls">' +
        `<button class="play" title="play or pause (space)" aria-label="play">${SIGN.play}</button>` +
        '<input class="scrub" type="range" min="0" step="1" value="0" aria-label="time" title="time (← →)">' +
        '<output class="time"></output>' +
        '<button class="slower" title="slower (−)" aria-label="slower">−</button>' +
        '<span class="speed"></span>' +
        '<button class="faster" title="faster (+)" aria-label="faster">+</button>' +
        `<button class="view" title="the view as at first (0)" aria-label="reset view">${SIGN.view}</button>` +
        "</div>";
      if (still) element.append(still);
      const find = (name) => element.querySelector(name);
      Object.assign(this, {
        playButton: find(".play"), scrub: find(".scrub"), time: find(".time"),
        speed: find(".speed"), slower: find(".slower"), faster: find(".faster"), viewButton: find(".view"),
      });
      if (!element.hasAttribute("tabindex")) element.tabIndex = 0;
      source.start(this);
    }

    begin(about, setup) {
      this.about = about;
      this.element.dataset.theme = about.theme.name;
      this.element.setAttribute("role", "group");
      this.element.setAttribute("aria-label", `motion: ${about.title}`);
      if (this.stage) {
        this.stage.apply(setup);
        return;
      }
      this.remark(about.notes);
      this.stage = new Stage(this.element.querySelector(".stage"), about);
      this.stage.apply(setup);
      this.stage.fit();
      this.scrub.max = about.count - 1;
      if (about.dark) this.follow();
      this.listen();
      this.run();
    }

    // Sentences that qualify the motion, below the buttons; a page around a player has them itself.
    remark(notes) {
      if (!notes.length) return;
      const remarks = document.createElement("div");
      Object.assign(remarks, { className: "remarks", tabIndex: 0 });
      remarks.setAttribute("role", "region");
      remarks.setAttribute("aria-label", "notes");
      for (const note of notes) {
        const words = document.createElement("p");
        words.textContent = note;
        remarks.append(words);
      }
      this.element.querySelector(".controls").after(remarks);
    }

    // Dark where the reader's surroundings are, or become so.
    follow() {
      const { theme, background, swatches, dark } = this.about;
      const light = { theme, background, swatches };
      const surroundings = matchMedia("(prefers-color-scheme: dark)");
      const wear = () => {
        const colours = surroundings.matches ? dark : light;
        this.element.dataset.theme = colours.theme.name;
        this.stage.wear(colours);
      };
      surroundings.addEventListener("change", wear);
      wear();
    }

    show(frame, state) {
      this.stage.show(frame.commands, frame.words);
      this.stage.viewer.set_dirty();
      const { element } = this;
      // Nothing moves by itself for readers who prefer so; the first frame tells that it does.
      if (element.dataset.frame === undefined && state.playing && CALM.matches) this.source.play(false);
      const whole = Math.floor(state.frame + 1e-9);
      element.dataset.frame = whole;
      element.dataset.playing = state.playing;
      element.dataset.speed = state.speed;
      element.dataset.time = frame.words.t;
      if (!this.dragging) this.scrub.value = whole;
      const end = this.about.start + this.about.duration;
      this.time.textContent = `${frame.words.t.toFixed(2)} / ${end.toFixed(2)} s`;
      this.scrub.setAttribute("aria-valuetext", `${frame.words.t.toFixed(2)} s`);
      element.dispatchEvent(new CustomEvent("twolink-time", { bubbles: true, detail: { time: frame.words.t } }));
      if (this.sign !== state.playing) {
        this.sign = state.playing;
        this.playButton.innerHTML = state.playing ? SIGN.pause : SIGN.play;
        this.playButton.setAttribute("aria-label", state.playing ? "pause" : "play");
      }
      this.speed.textContent = `× ${Number((state.speed * this.about.speed).toPrecision(3))}`;
    }

    // The picture of a frame of a film in the page, for a recording.
    picture(frame) {
      this.source.seek(frame);
      return this.stage.picture();
    }

    // The frame at a time (s), for the page about the player.
    seekTime(time) {
      const { about, source } = this;
      source.play(false);
      source.seek(Math.round((time - about.start) * about.fps / about.speed));
    }

    ended() {
      this.element.dataset.playing = "false";
      this.time.textContent = "the server has ended";
    }

    listen() {
      const { source, stage } = this;
      this.playButton.onclick = () => source.play(!source.state.playing);
      this.scrub.onpointerdown = () => { this.dragging = true; };
      this.scrub.onpointerup = this.scrub.onpointercancel = () => { this.dragging = false; };
      this.scrub.oninput = () => source.seek(Number(this.scrub.value));
      this.slower.onclick = () => this.hasten(-1);
      this.faster.onclick = () => this.hasten(1);
      this.viewButton.onclick = () => stage.fit();
      // A player in a page of text must not catch the reader's scrolling.
      const alone = this.element.classList.contains("alone");
      if (!alone) {
        stage.viewer.controls.dispose();
        stage.pane.style.touchAction = "auto";
      }
      (alone ? document : this.element).addEventListener("keydown", (event) => this.key(event));
      if (!alone) this.element.querySelector(".stage").addEventListener("click", () => this.element.focus());
      new ResizeObserver(() => stage.fit()).observe(stage.element);
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const { source } = this;
      const here = Math.floor(source.state.frame + 1e-9);
      const step = event.shiftKey ? 10 : 1;
      const does = {
        " ": () => source.play(!source.state.playing),
        ArrowRight: () => source.seek(here + step),
        ArrowLeft: () => source.seek(here - step),
        Home: () => source.seek(0),
        End: () => source.seek(source.last),
        "+": () => this.hasten(1), "=": () => this.hasten(1), "-": () => this.hasten(-1),
        0: () => this.stage.fit(),
      }[event.key];
      if (!does) return;
      // A button that has the focus is pressed by these keys, as everywhere.
      if (event.target.closest("button") && (event.key === " " || event.key === "Enter")) return;
      event.preventDefault();
      does();
    }

    hasten(by) {
      const at = SPEEDS.findIndex((speed) => speed >= this.source.state.speed - 1e-9);
      this.source.speed(SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at + by))]);
    }

    run() {
      this.source.tick();
      if (this.stage.viewer.needs_render) this.stage.draw();
      requestAnimationFrame(() => this.run());
    }
  }

  async function start() {
    const packed = document.getElementById("twolink-viewer");
    if (packed) {
      const script = document.createElement("script");
      script.textContent = new TextDecoder().decode(await inflated(packed.textContent));
      document.head.append(script);
    }
    if (!window.MeshCat) throw new Error("meshcat's viewer is missing");
    for (const element of document.querySelectorAll(".twolink-player")) {
      const film = element.querySelector('script[type="application/x-twolink-film"]');
      const source = film ? new InPage(await inflated(film.textContent)) : new Stream();
      element.twolink = new Player(element, source);
      element.dataset.ready = "true";
    }
  }

  async function startOrSay() {
    try {
      await start();
    } catch (error) {
      for (const element of document.querySelectorAll(".twolink-player:not([data-ready])")) {
        const still = element.querySelector(".still");
        element.innerHTML = '<p class="broken"></p>';
        element.firstChild.textContent = `This browser cannot show the motion (${error.message}).`;
        if (still) element.prepend(still);
      }
      throw error;
    }
  }

  if (document.readyState === "loading") addEventListener("DOMContentLoaded", startOrSay);
  else startOrSay();
})();
