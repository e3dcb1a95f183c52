"use strict";
// The participant's page: shows what the program says, sends keys, plays white noise.
const key = new URLSearchParams(location.search).get("key");
const element = (id) => document.getElementById(id);
let shown = {};
let shownAt = 0;
let audio = null;
let gain = null;

function send(message) {
  return fetch(`/act?key=${key}`, {
    method: "POST",
    headers: { "X-Hapticd": "1", "Content-Type": "application/json" },
    body: JSON.stringify(message),
  }).catch(() => {});
}

// Noise.

function playNoise() {
  audio = new AudioContext();
  const seconds = 4;
  const buffer = audio.createBuffer(1, seconds * audio.sampleRate, audio.sampleRate);
  const samples = buffer.getChannelData(0);
  for (let i = 0; i < samples.length; ++i) samples[i] = 2 * Math.random() - 1;
  const source = audio.createBufferSource();
  source.buffer = buffer;
  source.loop = true;
  gain = audio.createGain();
  gain.gain.value = Number(element("gain").value);
  source.connect(gain).connect(audio.destination);
  source.start();
  audio.onstatechange = sayNoise;
  // Other headphones may be much louder: the session waits for a new start.
  navigator.mediaDevices?.addEventListener("devicechange", () => audio.suspend());
  sayNoise();
}

function sayNoise() {
  send({ do: "noise", state: audio.state === "interrupted" ? "suspended" : audio.state, gain: gain.gain.value });
  if (audio.state !== "running") element("setup").hidden = false;
}

// Heard while it is set.
element("gain").addEventListener("input", () => {
  if (!audio) playNoise();
  gain.gain.value = Number(element("gain").value);
});
element("gain").addEventListener("change", sayNoise);

element("begin").addEventListener("click", async () => {
  if (audio) await audio.resume();
  else playNoise();
  sayNoise();
  element("setup").hidden = true;
  element("session").hidden = false;
  document.documentElement.requestFullscreen?.().catch(() => {});
  element("begin").blur();
});

// Keys.

document.addEventListener("keydown", (event) => {
  if (event.repeat || element("session").hidden || event.ctrlKey || event.altKey || event.metaKey) return;
  if (shown.phase === "rate" && event.key !== "Escape") return;
  if (event.key.length !== 1) return;
  event.preventDefault();
  send({ do: "key", key: event.key, after_ms: performance.now() - shownAt });
});

element("rating_input").addEventListener("input", () => {
  element("rating_value").textContent = element("rating_input").value;
});

element("rating").addEventListener("submit", (event) => {
  event.preventDefault();
  send({ do: "key", key: element("rating_input").value, after_ms: performance.now() - shownAt });
});

element("abort").addEventListener("click", () => {
  send({ do: "abort" });
});

// What is shown.

const WORDS = { first: "the first", second: "the second", same: "the same" };

function drawPlace(at, places = [[0, 0]]) {
  const canvas = element("place");
  canvas.hidden = !at;
  if (!at) return;
  const context = canvas.getContext("2d");
  const style = getComputedStyle(document.body);
  const middle = [0, 1].map((axis) => places.reduce((sum, one) => sum + one[axis], 0) / places.length);
  const reach = Math.max(...places.map((one) => Math.hypot(one[0] - middle[0], one[1] - middle[1])));
  const scale = canvas.width / (2 * reach + 120); // pixels per mm
  const x = (mm) => canvas.width / 2 + scale * (mm - middle[0]);
  const y = (mm) => canvas.height / 2 - scale * (mm - middle[1]);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.lineWidth = 2;
  const away = (one) => Math.hypot(at[0] - one[0], at[1] - one[1]);
  const nearest = places.reduce((best, one) => (away(one) < away(best) ? one : best));
  for (const place of places) {
    // The one at which the tool is looks different.
    context.strokeStyle = style.getPropertyValue(places.length > 1 && place === nearest ? "--accent" : "--quiet");
    for (const radius of [10, 25]) {
      context.beginPath();
      context.arc(x(place[0]), y(place[1]), radius * scale, 0, 2 * Math.PI);
      context.stroke();
    }
  }
  if (places.length > 1) {
    context.fillStyle = style.getPropertyValue("--quiet");
    context.font = "16px sans-serif";
    context.textAlign = "center";
    places.forEach((place, index) => context.fillText(["left", "right"][index] ?? "", x(place[0]), y(place[1]) + 34 * scale + 12));
  }
  context.fillStyle = style.getPropertyValue("--accent");
  context.beginPath();
  // The higher the tool, the larger its dot.
  context.arc(x(at[0]), y(at[1]), 5 + Math.min(20, Math.max(0, at[2])) / 2, 0, 2 * Math.PI);
  context.fill();
}

function show(state) {
  const isNew = state.phase !== shown.phase || state.text !== shown.text;
  if (state.phase === "rate" && shown.phase !== "rate") {
    element("rating_input").value = 50;
    element("rating_value").textContent = "50";
  }
  shown = state;
  document.body.dataset.phase = state.phase;
  if (isNew) {
    shownAt = performance.now();
    element("text").textContent = state.text;
    element("keys").replaceChildren(
      ...Object.entries(state.keys ?? {}).map(([name, answer]) => {
        const item = document.createElement("li");
        const cap = document.createElement("kbd");
        cap.textContent = name;
        item.append(cap, ` ${WORDS[answer]}`);
        return item;
      }),
    );
  }
  element("training").hidden = !state.training;
  element("seconds").textContent = state.seconds_left ? `${state.seconds_left} s` : "";
  element("progress").value = state.progress ?? 0;
  element("rating").hidden = state.phase !== "rate";
  drawPlace(state.tool_mm, state.places_mm);
}

const events = new EventSource(`/events?key=${key}`);
events.onmessage = (event) => show(JSON.parse(event.data));
events.onerror = () => show({ phase: "lost", text: "The program is not there. Please call the experimenter." });
