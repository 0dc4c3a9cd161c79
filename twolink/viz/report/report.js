// The report's film and curves move together: a cursor runs in the curves, and a click in a curve or
// on a time moves the film.
(function () {
  "use strict";

  // Axes of a picture, in parts of its size: left, right, top, bottom, and the times at both sides.
  const axesOf = (frame) => JSON.parse(frame.dataset.axes);

  function cursors(frame) {
    return axesOf(frame).map(([left, right, top, bottom, from, to]) => {
      const line = document.createElement("span");
      line.className = "cursor";
      line.style.top = `${100 * top}%`;
      line.style.height = `${100 * (bottom - top)}%`;
      frame.append(line);
      return (time) => {
        const part = (time - from) / (to - from);
        line.hidden = !(part >= 0 && part <= 1);
        line.style.left = `${100 * (left + part * (right - left))}%`;
      };
    });
  }

  function timeAt(frame, event) {
    const box = frame.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width, y = (event.clientY - box.top) / box.height;
    for (const [left, right, top, bottom, from, to] of axesOf(frame))
      if (x >= left && x <= right && y >= top && y <= bottom)
        return from + ((x - left) / (right - left)) * (to - from);
    return null;
  }

  function connect(section) {
    const player = section.querySelector(".twolink-player");
    const frames = [...section.querySelectorAll(".timed")];
    const lines = frames.flatMap(cursors);
    const move = (time) => lines.forEach((line) => line(time));
    const seek = (time) => {
      if (player && player.twolink) player.twolink.seekTime(time);
      else move(time);
    };
    section.addEventListener("twolink-time", (event) => move(event.detail.time));
    for (const frame of frames)
      frame.addEventListener("click", (event) => {
        const time = timeAt(frame, event);
        if (time !== null) seek(time);
      });
    for (const button of section.querySelectorAll("button.time"))
      button.addEventListener("click", () => seek(Number(button.dataset.time)));
    move(player && player.dataset.time ? Number(player.dataset.time) : 0);
  }

  function start() {
    document.querySelectorAll("section").forEach(connect);
    for (const button of document.querySelectorAll("button.enlarge"))
      button.addEventListener("click", () => {
        const large = button.closest("figure").querySelector(".frame").classList.toggle("large");
        button.textContent = large ? "Fit to the page" : "Enlarge";
        button.setAttribute("aria-pressed", large);
      });
    // Everything is printed.
    addEventListener("beforeprint", () =>
      document.querySelectorAll("details.print").forEach((each) => { each.open = true; }));
  }

  if (document.readyState === "loading") addEventListener("DOMContentLoaded", start);
  else start();
})();
