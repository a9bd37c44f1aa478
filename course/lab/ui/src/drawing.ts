// Pictures that are drawn again and again.

const FRAME = 30; // ms at least between two pictures: more of them look the same, and take a core

/** Call `draw` with the page's time (ms) as often as the page is drawn, up to 30 times a second; return how to end it. */
export function drawAgain(draw: (now: number) => void): () => void {
  let [request, drawn] = [0, -FRAME];
  const again = (now: number) => {
    request = requestAnimationFrame(again);
    if (now - drawn >= FRAME) {
      drawn = now;
      draw(now);
    }
  };
  request = requestAnimationFrame(again);
  return () => cancelAnimationFrame(request);
}
