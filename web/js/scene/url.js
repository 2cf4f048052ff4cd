// Which scene the page begins with, and where it is kept: in the URL.
import { link, pack, read, unpack } from "../address.js";
import { get } from "../api.js";
import { storeyCount } from "./channels.js";

const MAX_LENGTH = 100000; // characters of a link

// There before anything is fetched.
export const initialScene = () => ({
  title: "The paper's sponge, released from 15 mm",
  structure: { mass: 1.35, stiffness: 865, damping: 1.092 },
  dampers: [{ mass: 0.1107, clearance: 0.015, buffer: "sponge" }],
  excitation: { kind: "free", displacement: 0.015 },
  duration: 10,
  sample_rate: 1000,
});

// The scene that was `left` here, else the one that the query asks for.
export async function open({ s, example, result, job, buffer, record }, left) {
  const { title, ...scene } = initialScene();
  const ask = (kind, id, part = "") => get(`v1/${kind}/${encodeURIComponent(id)}${part}`);
  if (left) return left;
  if (s)
    return unpack(s).catch(() =>
      Promise.reject(new Error("The scene in this link cannot be read. Was it cut off?")),
    );
  if (example) return ask("examples", example);
  if (result) return typical((await ask("results", result)).scene);
  if (job) return typical(await ask("jobs", job, "/scene"));
  if (buffer) return { ...scene, dampers: [{ ...scene.dampers[0], buffer }] };
  if (record)
    return {
      ...scene,
      excitation: { kind: "record", name: record },
      duration: Math.ceil((await ask("records", record)).duration) || 1,
    };
  return initialScene();
}

// The same scene as one would type it: materials by name, the usual channels unsaid.
function typical(scene) {
  const { dampers = [], output, study = {} } = scene;
  const { channels } = output;
  for (const damper of dampers)
    for (const name in damper) damper[name] = damper[name].material ?? damper[name];
  if (
    channels.length === 3 * storeyCount(scene) + 2 * dampers.length &&
    /^(displacement|velocity|acceleration|damper_displacement|contact_force|_\d+|,)*$/.test(
      channels,
    )
  )
    delete output.channels;
  delete study.materials;
  delete study.records;
  return scene;
}

// Keeps a scene in the URL while it is the last one; false where it is too long.
export async function keep(scene, isLast) {
  const s = await pack(scene);
  const fits = s.length <= MAX_LENGTH;
  if (isLast() && /^(scene)?$/.test(read().path.join()))
    history.replaceState(fits ? null : scene, "", link("scene", fits ? { s } : {}));
  return fits;
}
