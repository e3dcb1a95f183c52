"use strict";
// The experimenter's page: validity, progress and safety; not what is presented.
const key = new URLSearchParams(location.search).get("key");
const element = (id) => document.getElementById(id);
const PHASES = {
  wait: "waiting",
  ready: "waits for the participant's space bar",
  guided: "the tool is led",
  touch: "the participant touches",
  question: "the question is asked",
  rate: "the rating is asked",
  warning: "a trial was discarded",
  rest: "break",
  done: "done",
  lost: "the program is not there",
};

function show(state) {
  element("participant").textContent = state.participant ?? "…";
  element("phase").textContent = PHASES[state.phase] ?? state.phase;
  document.body.dataset.phase = state.phase;
  const condition = state.training ? "training" : `${state.condition} of ${state.conditions}`;
  element("condition").textContent = state.conditions ? condition : "–";
  element("trial").textContent = state.trial ? `${state.trial}${state.attempt > 1 ? `, attempt ${state.attempt}` : ""}` : "–";
  for (const name of ["answered", "presented", "discarded"]) element(name).textContent = state[name] ?? 0;
  const flaws = state.flaws ?? null;
  element("flaws").textContent = flaws === null ? "–" : flaws.length ? flaws.join(", ").replaceAll("_", " ") : "valid";
  element("flaws").dataset.good = flaws === null ? "" : String(flaws.length === 0);
  element("page").textContent = state.page ? "open" : "closed";
  element("page").dataset.good = String(Boolean(state.page));
  const noise = state.noise ?? {};
  element("noise").textContent = noise.state === "running" ? `on, level ${noise.gain}` : noise.state ?? "–";
  const fault = (state.fault ?? "").replaceAll("_", " ");
  element("rig").textContent = fault ? `no force: ${fault}` : state.rig || "ready";
  element("rig").dataset.good = String(!fault && !state.rig);
  element("cleared").hidden = !fault;
  element("clear_refused").textContent = state.clear_refused ?? "";
}

function send(message) {
  fetch(`/act?key=${key}`, {
    method: "POST",
    headers: { "X-Hapticd": "1", "Content-Type": "application/json" },
    body: JSON.stringify(message),
  }).catch(() => {});
}

element("clear").addEventListener("click", () => send({ do: "clear" }));

element("abort").addEventListener("click", () => send({ do: "abort" }));

const events = new EventSource(`/events?key=${key}`);
events.onmessage = (event) => show(JSON.parse(event.data));
events.onerror = () => show({ phase: "lost" });
