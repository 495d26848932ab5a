// The head-up display over viser's canvas, and what viser's client needs inside a frame.

// viser reconnects only while the document has the focus, which a frame that nobody has clicked never has.
document.hasFocus = () => document.visibilityState === "visible";

addEventListener("DOMContentLoaded", () => {
  const display = document.getElementById("display");
  const count = new Intl.NumberFormat("en");
  const outcomes = ["", "arrival", "collision", "timeout"];
  const colours = ["#339af0", "#ff922b", "#be5ceb", "#22becd", "#f06595", "#fcc419", "#5c7cfa", "#a88c6e"];
  const waiting = { "no worker": "No worker is running this training", waiting: "Waiting for the worker …" };

  const element = (tag, name, text) => {
    const made = document.createElement(tag);
    made.className = name;
    made.textContent = text ?? "";
    return made;
  };

  const draw = (score) => {
    const parts = [];
    if (score.state === "live") {
      const rate = score.speed >= 10 ? Math.round(score.speed) : +score.speed.toFixed(1);
      const title = element("div", "title");
      title.append(
        element("span", "mode", score.after_training ? "Best policy" : score.mode === "policy" ? "Policy" : "Training"),
        element("span", "", score.mode === "policy" ? `${rate}× real time` : `time-lapse, ${rate}×`),
      );
      parts.push(title, element("div", "step", `${score.after_training ? "after training, " : ""}step ${count.format(score.step)}`));
      const tally = element("div", "tally");
      for (const [name, word, value] of [
        ["arrival", "arrived", score.arrivals],
        ["collision", "collided", score.collisions],
        ["timeout", "timed out", score.timeouts],
      ]) {
        tally.append(element("span", name, `${count.format(value)} ${word}`));
      }
      parts.push(tally);
      if (score.robots.length) {
        const list = element("div", "robots");
        for (const robot of score.robots) {
          const line = element("div", `robot ${outcomes[robot.outcome]}`);
          const dot = element("i", "");
          dot.style.background = colours[robot.index % colours.length];
          line.append(dot, element("span", "", `${robot.reward >= 0 ? "+" : "−"}${Math.abs(robot.reward).toFixed(0)}`));
          list.append(line);
        }
        list.title = "Reward since the last target; the edge tells how the last attempt ended";
        parts.push(list);
      }
    } else {
      const starting = score.after_training ? "Starting the best policy …" : waiting[score.state];
      parts.push(element("div", "waiting", score.refusal ?? starting));
    }
    display.dataset.state = score.state;
    display.replaceChildren(...parts);
    display.hidden = false;
  };

  const connect = () => {
    const path = `${location.pathname.replace(/\/$/, "")}/display`;
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}`);
    socket.onmessage = (event) => draw(JSON.parse(event.data));
    socket.onclose = () => setTimeout(connect, 1000);
  };
  connect();
});
