// Additions to the theme for keyboards and screen readers.

const WIDE = "pre, .table-wrapper, .formula, .strip, p:has(> img)";

function describe() {
  for (const caption of document.querySelectorAll(".caption[role=heading]")) {
    caption.setAttribute("aria-level", "2");
  }
  const names = { ".sidebar-drawer": "Site", ".toc-drawer": "On this page" };
  for (const [place, name] of Object.entries(names)) {
    document.querySelector(place)?.setAttribute("aria-label", name);
  }
  // The search page has no heading.
  const main = document.querySelector("article[role=main]");
  if (main && !document.querySelector("h1")) {
    const heading = document.createElement("h1");
    heading.textContent = "Search";
    main.prepend(heading);
  }
}

// Only a box that scrolls is reached by the tab key.
function reach() {
  for (const box of document.querySelectorAll(WIDE)) {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
    else box.removeAttribute("tabindex");
  }
}

addEventListener("DOMContentLoaded", describe);
addEventListener("load", reach);
addEventListener("resize", reach);
