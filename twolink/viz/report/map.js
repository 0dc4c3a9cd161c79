// A map of first times: a click, or the arrow keys, choose a run, whose motion is drawn beside.
(function () {
  "use strict";

  async function read(script) {
    const packed = Uint8Array.from(atob(script.textContent.trim()), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const buffer = await new Response(stream).arrayBuffer();
    const length = new DataView(buffer).getUint32(0, true);
    const about = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    // A copy: numbers of four bytes must begin at a multiple of four.
    return { about, parts: new Int32Array(buffer.slice(4 + length)) };
  }

  // The angles (rad) of a run at its samples, from their differences.
  function motionOf({ about, parts }, run) {
    const count = 2 * about.samples, found = new Float64Array(count);
    const unit = (2 * Math.PI) / about.turn;
    for (let k = 0, sums = [0, 0]; k < count; k += 1) {
      sums[k % 2] += parts[run * count + k];
      found[k] = sums[k % 2] * unit;
    }
    return found;
  }

  function anglesAt(motion, part) {
    const last = motion.length / 2 - 1, place = Math.min(part, 1) * last;
    const before = Math.min(Math.floor(place), last - 1), share = place - before;
    return [0, 1].map((link) => {
      const from = motion[2 * before + link], to = motion[2 * before + 2 + link];
      return from + share * (to - from);
    });
  }

  function nearest(values, value) {
    let found = 0;
    values.forEach((each, k) => {
      if (Math.abs(each - value) < Math.abs(values[found] - value)) found = k;
    });
    return found;
  }

  async function connect(explorer) {
    const data = await read(explorer.querySelector("script"));
    const { about } = data, [xs, ys] = about.places;
    const [left, right, top, bottom] = about.box, [x0, x1, y0, y1] = about.limits;
    const chooser = explorer.querySelector(".chooser"), frame = chooser.querySelector(".frame");
    const mark = chooser.querySelector(".mark"), canvas = explorer.querySelector("canvas");
    const play = explorer.querySelector(".play"), scrub = explorer.querySelector(".scrub");
    const clock = explorer.querySelector(".clock"), words = explorer.querySelector(".chosen");
    const reach = Math.max(...about.lengths.map(([first, second]) => Math.abs(first) + Math.abs(second))) || 1;
    const state = { place: [0, 0], motion: null, lengths: null, part: 0, since: null };
    frame.append(mark);

    function draw() {
      const scale = devicePixelRatio || 1, size = canvas.clientWidth * scale;
      canvas.width = canvas.height = size;
      const pen = canvas.getContext("2d"), style = getComputedStyle(explorer);
      pen.clearRect(0, 0, size, size);
      clock.textContent = `${(state.part * about.duration).toFixed(2)} s`;
      scrub.value = Math.round(1000 * state.part);
      if (!state.motion) return;
      const unit = (0.46 * size) / reach, at = ([x, y]) => [size / 2 + unit * x, size / 2 + unit * y];
      const points = (part) => {
        const [q1, q2] = anglesAt(state.motion, part), [first, second] = state.lengths;
        const joint = [first * Math.cos(q1), first * Math.sin(q1)];
        return [[0, 0], joint, [joint[0] + second * Math.cos(q2), joint[1] + second * Math.sin(q2)]];
      };
      const line = (places, colour, width) => {
        pen.beginPath();
        places.forEach((place, k) => pen[k ? "lineTo" : "moveTo"](...at(place)));
        pen.strokeStyle = colour;
        pen.lineWidth = width * scale;
        pen.lineJoin = pen.lineCap = "round";
        pen.stroke();
      };
      // The path of D in the last second.
      const from = Math.max(0, state.part - 1 / about.duration), path = [];
      for (let k = 0; k <= 60; k += 1) path.push(points(from + ((state.part - from) * k) / 60)[2]);
      line(path, style.getPropertyValue("--soft"), 1);
      const [pivot, joint, end] = points(state.part);
      line([pivot, joint], style.getPropertyValue("--accent"), 6);
      line([joint, end], style.getPropertyValue("--warn"), 6);
      for (const place of [pivot, joint]) {
        pen.beginPath();
        pen.arc(...at(place), 4 * scale, 0, 2 * Math.PI);
        pen.fillStyle = style.getPropertyValue("--ink");
        pen.fill();
      }
    }

    function running(goes) {
      state.since = goes ? performance.now() - 1000 * state.part * about.duration : null;
      play.textContent = goes ? "❚❚" : "▶";
      play.setAttribute("aria-label", goes ? "Pause" : "Play");
      if (goes) requestAnimationFrame(step);
    }

    function step(now) {
      if (state.since === null) return;
      state.part = Math.max(0, Math.min(1, (now - state.since) / 1000 / about.duration));
      draw();
      if (state.part < 1) requestAnimationFrame(step);
      else running(false);
    }

    function choose(column, row) {
      const within = (k, count) => Math.max(0, Math.min(count - 1, k));
      state.place = [within(column, xs.length), within(row, ys.length)];
      const [i, j] = state.place, run = j * xs.length + i;
      state.lengths = about.lengths[about.lengths.length > 1 ? run : 0];
      state.motion = motionOf(data, run);
      state.part = 0;
      mark.hidden = false;
      mark.style.left = `${100 * (left + ((xs[i] - x0) / (x1 - x0)) * (right - left))}%`;
      mark.style.top = `${100 * (bottom - ((ys[j] - y0) / (y1 - y0)) * (bottom - top))}%`;
      const short = (value) => Number(value.toPrecision(7));
      const values = about.names.map((name, k) => `${name} = ${short(about.places[k][state.place[k]])} ${about.units[k]}`.trim());
      words.textContent = `${values.join(", ")}: ${about.words[run]}`;
      running(!matchMedia("(prefers-reduced-motion: reduce)").matches);
      draw();
    }

    frame.addEventListener("click", (event) => {
      const box = frame.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width, y = (event.clientY - box.top) / box.height;
      if (x < left || x > right || y < top || y > bottom) return;
      const a = x0 + ((x - left) / (right - left)) * (x1 - x0);
      choose(nearest(xs, a), nearest(ys, y0 + ((bottom - y) / (bottom - top)) * (y1 - y0)));
    });
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    chooser.addEventListener("keydown", (event) => {
      const move = moves[event.key];
      if (!move) return;
      event.preventDefault();
      const [column, row] = mark.hidden ? [0, 0] : move.map((each, k) => state.place[k] + each);
      choose(column, row);
    });
    play.addEventListener("click", () => {
      if (state.part >= 1) state.part = 0;
      if (state.motion) running(state.since === null);
    });
    scrub.addEventListener("input", () => {
      running(false);
      state.part = scrub.value / 1000;
      draw();
    });
    addEventListener("resize", draw);
    draw();
    explorer.dataset.ready = "";
  }

  function start() {
    document.querySelectorAll(".explorer").forEach(connect);
  }

  if (document.readyState === "loading") addEventListener("DOMContentLoaded", start);
  else start();
})();
