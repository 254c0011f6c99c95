// SPDX-License-Identifier: Apache-2.0
// ---- watching resources, and the age of what is shown

const SILENCE = 3000;  // [ms] without a word after which the page no longer says "Live"

/// Watches a resource by WebSocket, else polls every 2 s. Reconnects after a loss. The robot is asked for a heartbeat: without one, an unchanged
/// value and a dead connection look the same.
///
/// @param on  callbacks: g(graph or JSON, response if polled), state(text), problem(Problem), silence(time): nothing was heard since that time
class Watch {
  static maxSockets = 6;  // open sockets; further resources are polled
  static all = new Set();
  static onchange = () => {};

  constructor(iri, on, { socket = true, every = 2000, accept = N_TRIPLES, interval = 0.1 } = {}) {
    Object.assign(this, { iri, on, every, accept, interval, allowsSocket: socket, tries: 0, socketAfter: 0, heardAt: performance.now() });
  }

  start() {
    if (this.running) return;
    this.running = true;
    Watch.all.add(this);
    this.openOrPoll();
  }
  stop() {
    this.running = false;
    this.missed = true;
    Watch.all.delete(this);
    clearTimeout(this.timer);
    const { socket } = this;
    if (socket?.readyState === 0) socket.onopen = () => socket.close();  // close() while connecting makes the browser log a warning
    else socket?.close();
    this.socket = null;
    Watch.onchange();
  }
  setState(state) {
    this.state = state;
    this.on.state?.(state);
    Watch.onchange();
  }
  schedule(ms) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.running && this.openOrPoll(), ms);
  }
  retryLater() {
    const pause = Math.min(8000, 500 * 2 ** this.tries++) * (0.75 + Math.random() / 2);
    this.missed = true;
    this.setState("lost");
    this.schedule(pause);
  }
  openOrPoll() {
    const open = [...Watch.all].filter((w) => w.socket).length;
    if (this.allowsSocket && open < Watch.maxSockets && Date.now() >= this.socketAfter) this.open();
    else this.poll();
  }

  /// A word of the robot has come: a message, a heartbeat or a response.
  hears() {
    if (this.missed || this.beats) if (performance.now() - this.heardAt > SILENCE) this.on.silence?.(this.heardAt);
    this.missed = false;
    this.heardAt = performance.now();
  }
  /// How long nothing was heard although something should have been [ms]. A socket without heartbeats may be silent.
  silent() {
    const ms = performance.now() - this.heardAt;
    return this.state === "polling" ? Math.max(0, ms - this.every) : this.state === "live" && this.beats ? ms : 0;
  }
  /// Until when what is shown is known to be true, by performance.now().
  knownUntil() { return this.state === "lost" || this.silent() > SILENCE ? this.heardAt : performance.now(); }

  open() {
    const url = new URL(local(this.iri));
    url.protocol = url.protocol.replace("http", "ws");
    url.searchParams.set("accept", this.accept);
    url.searchParams.set("minimumInterval", this.interval);
    url.searchParams.set("queueLength", "0");  // latest value only: queued states of an invocation would arrive late
    url.searchParams.set("heartbeat", "1");
    let socket, opened = false;
    try { socket = this.socket = new WebSocket(url, "lrt.stamped"); } catch {  // a browser in which 'self' of connect-src does not include ws:
      this.socketAfter = Infinity;
      return this.poll();
    }
    let isStamped = false;  // the stamp of the next message has come
    socket.onopen = () => {
      opened = true;
      this.tries = 0;
      this.beats = false;
      if (this.socket === socket) this.setState("live");
    };
    socket.onmessage = ({ data }) => {
      if (this.socket !== socket) return;
      this.hears();
      if (isStamped) {
        isStamped = false;
        return this.on.g(parseBody(this.accept, data));
      }
      const { sequence, heartbeat } = JSON.parse(data);
      isStamped = sequence !== undefined;
      if (heartbeat) {
        this.beats = true;
        hearTime(heartbeat);
      }
    };
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      this.beats = false;
      if (event.code === 1000) {  // the subscription was cancelled, by this page or another client
        this.finished = true;
        this.stop();
        this.setState("cancelled");
      } else {
        this.missed = true;
        if (!opened) this.socketAfter = Date.now() + 30000;  // The handshake failed. Polling shows the reason.
        this.poll();
      }
    };
  }
  async poll() {
    try {
      const response = await sendRequest("GET", this.iri, { accept: `${this.accept}, ${PROBLEM}`, etag: this.etag });
      if (!this.running) return;
      const back = this.state === "lost" && this.allowsSocket;
      if (back) this.socketAfter = 0;
      this.tries = 0;
      this.hears();
      this.setState("polling");
      if (response.status === 200) {
        this.etag = response.etag;
        this.on.g(response.g, response);
      }
      this.schedule(back ? 0 : this.every);
    } catch (e) {
      if (!this.running) return;
      if (e instanceof Unreachable) return this.retryLater();
      this.hears();
      this.setState("polling");
      this.on.problem?.(e);
      if (e.status === 404) this.stop();
      else this.schedule(this.every);
    }
  }
}

Watch.onchange = () => {
  const states = [...Watch.all].map((w) => w.state), silent = Math.max(0, ...[...Watch.all].map((w) => w.silent()));
  const state = states.includes("lost") ? "lost" : silent > SILENCE ? "silent" : states.includes("live") ? "live" : states.includes("polling") ? "polling" : "";
  const words = { lost: "Connection lost – trying again", silent: `No word for ${Math.floor(silent / 1000)} s`, live: "Live", polling: "Live by polling" };
  $("link").className = state;
  setText($("link"), words[state] ?? "");
  document.body.classList.toggle("lost", ["lost", "silent"].includes(state));
};
setInterval(Watch.onchange, 500);

// Hidden pages close their connections after a delay, and left pages at once: browsers keep left pages for the Back button.
let hiddenTimer, suspendedWatches = [];
const suspendWatches = () => { suspendedWatches.push(...Watch.all); suspendedWatches.forEach((w) => w.stop()); };
const resumeWatches = () => suspendedWatches.splice(0).forEach((w) => w.start());
document.addEventListener("visibilitychange", () => {
  clearTimeout(hiddenTimer);
  if (document.hidden) hiddenTimer = setTimeout(suspendWatches, 20000);
  else resumeWatches();
});
addEventListener("pagehide", suspendWatches);
addEventListener("pageshow", resumeWatches);
