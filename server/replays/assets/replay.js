// Names for the controls of viser's player, which has none for them, and its look told apart from viser's own panels.
addEventListener("DOMContentLoaded", () => {
  if (parent !== window) document.body.dataset.embedded = "";
  const name = () => {
    const slider = document.querySelector(".mantine-Slider-root");
    const bar = slider?.closest(".mantine-Paper-root");
    if (!bar) return;
    bar.dataset.playback = "";
    bar.querySelector("button").setAttribute("aria-label", "Play or pause");
    slider.querySelector("[role=slider]")?.setAttribute("aria-label", "Time");
    const [seconds, speed] = bar.querySelectorAll("input:not([type=hidden])");
    seconds?.setAttribute("aria-label", "Seconds");
    speed?.setAttribute("aria-label", "Speed");
    observer.disconnect();
    const time = slider.querySelector("[role=slider]");
    const chapter = document.querySelector("[data-chapters]");
    if (chapter) follow(time, chapter);
    if (parent !== window) share(time, seconds);
  };
  // A time lapse says which checkpoint drives.
  const follow = (time, chapter) => {
    const chapters = JSON.parse(chapter.dataset.chapters);
    const write = () => {
      const shown = Number(time.getAttribute("aria-valuenow"));
      const text = chapters.findLast(([begins]) => begins <= shown + 1e-6)?.[1] ?? "";
      if (chapter.textContent !== text) chapter.textContent = text;
      requestAnimationFrame(write);
    };
    requestAnimationFrame(write);
  };
  // Inside Mapless' own page: it hears which moment is shown, and asks for others. The player itself can do neither.
  const share = (time, field) => {
    const type = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
    let told = NaN;
    let due = 0;
    const tell = (now) => {
      const shown = Number(time.getAttribute("aria-valuenow"));
      if (shown !== told && now >= due) {
        told = shown;
        due = now + 60;
        parent.postMessage({ replaySeconds: shown }, location.origin);
      }
      requestAnimationFrame(tell);
    };
    requestAnimationFrame(tell);
    addEventListener("message", (event) => {
      const seconds = event.data?.replaySeek;
      if (event.origin !== location.origin || event.source !== parent || !Number.isFinite(seconds)) return;
      type.call(field, Math.max(0, seconds).toFixed(3));
      field.dispatchEvent(new Event("input", { bubbles: true }));
    });
  };
  const observer = new MutationObserver(name);
  observer.observe(document.body, { childList: true, subtree: true });
});
