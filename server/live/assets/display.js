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

  const name = (score) =>
    score.checkpoint ? "Checkpoint" : score.playground ? "Playground" : score.after_training ? "Best policy" : score.mode === "policy" ? "Policy" : "Training";

  const draw = (score) => {
    const parts = [];
    if (score.state === "live") {
      const rate = score.speed >= 10 ? Math.round(score.speed) : +score.speed.toFixed(1);
      const title = element("div", "title");
      title.append(
        element("span", "mode", name(score)),
        element("span", "", score.mode === "policy" ? `${rate}× real time` : `time-lapse, ${rate}×`),
      );
      if (!score.playground) title.append(element("span", "", `, step ${count.format(score.step)}`));
      parts.push(title);
      const tally = element("div", "tally");
      for (const [name, word, value] of [
        ["arrival", "arrived", score.arrivals],
        ["collision", "collided", score.collisions],
        ["timeout", "timed out", score.timeouts],
      ]) {
        tally.append(element("span", name, `${count.format(value)} ${word}`));
      }
      parts.push(tally);
      // Of the one that is followed: the figures of all would hide the arena.
      if (score.robots.length === 1) {
        const [robot] = score.robots;
        const line = element("div", `robot ${outcomes[robot.outcome]}`);
        const dot = element("i", "");
        dot.style.background = colours[robot.index % colours.length];
        const reward = `${robot.reward >= 0 ? "+" : "−"}${Math.abs(robot.reward).toFixed(0)}`;
        line.append(dot, element("span", "", `reward since its last target ${reward}`));
        parts.push(line);
      }
    } else {
      const starting = score.playground || score.checkpoint ? "Starting the policy …" : score.after_training ? "Starting the best policy …" : waiting[score.state];
      parts.push(element("div", "waiting", score.refusal ?? starting));
    }
    display.dataset.state = score.state;
    display.replaceChildren(...parts);
    display.hidden = false;
  };

  // The page around the frame says more of the moment that is shown: it is told with it.
  const tell = (moment) => {
    if (moment && parent !== window) parent.postMessage({ playgroundMoment: moment }, location.origin);
  };

  let drawn = "";
  const hear = ({ moment, ...score }) => {
    tell(moment);
    const text = JSON.stringify(score);
    if (text !== drawn) draw(score);
    drawn = text;
  };

  const connect = () => {
    const path = `${location.pathname.replace(/\/$/, "")}/display`;
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}`);
    socket.onmessage = (event) => hear(JSON.parse(event.data));
    socket.onclose = () => setTimeout(connect, 1000);
  };
  connect();
});
