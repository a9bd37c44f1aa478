// Pictures that are drawn again and again.

const FRAME = 28; // ms at least between two pictures: more of them look the same, and take a core

/** Call `draw` with the page's time (ms) as often as the page is drawn, up to 30 times a second on a common screen; return
 * how to end it.  Between two of them the page is not asked for pictures: each costs time, also when nothing is drawn.
 */
export function drawAgain(draw: (now: number) => void): () => void {
  let [request, timer] = [0, 0];
  const ask = () => {
    request = requestAnimationFrame(again);
  };
  const again = (now: number) => {
    timer = window.setTimeout(ask, FRAME);
    draw(now);
  };
  ask();
  return () => {
    window.clearTimeout(timer);
    cancelAnimationFrame(request);
  };
}
