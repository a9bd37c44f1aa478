// Arrows and Page Up/Down go from slide to slide; on paper all that is folded is shown.
const slides = [...document.querySelectorAll("section")];
addEventListener("keydown", event => {
  const step = { ArrowRight: 1, PageDown: 1, ArrowLeft: -1, PageUp: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  const now = slides.findLastIndex(slide => slide.getBoundingClientRect().top < 10);
  slides[Math.min(slides.length - 1, Math.max(0, now + step))].scrollIntoView();
});
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(part => { part.open = true; }));
