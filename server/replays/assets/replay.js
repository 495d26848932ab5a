// Names for the controls of viser's player, which has none for them, and its look told apart from viser's own panels.
addEventListener("DOMContentLoaded", () => {
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
  };
  const observer = new MutationObserver(name);
  observer.observe(document.body, { childList: true, subtree: true });
});
