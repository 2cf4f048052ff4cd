// Where the reader is, and with it the whole state of a page: "#/results/r-1?from=0&to=2" in the URL.

// {path: ["results", "r-1"], query: {from: "0", to: "2"}}
export function read() {
  const [path, query] = location.hash.replace(/^#\/?/, "").split(/\?(.*)/s);
  return {
    path: path.split("/").filter(Boolean).map(decode),
    query: Object.fromEntries(new URLSearchParams(query ?? "")),
  };
}

function decode(word) {
  try {
    return decodeURIComponent(word);
  } catch {
    return word;
  }
}

// link("results/r-1", {from: 0}): the href, without what is null, undefined or "".
export function link(path, query = {}) {
  const kept = Object.entries(query).filter(([, value]) => (value ?? "") !== "");
  const text = new URLSearchParams(kept).toString().replace(/%(2C|40|2F)/g, decodeURIComponent); // these read better bare
  return `#/${path}${text && `?${text}`}`;
}

// To another page.
export function go(path, query) {
  location.hash = link(path, query).slice(1);
}

// To another page in place of this one: "back" does not come here again.
export function replace(path, query) {
  history.replaceState(null, "", link(path, query));
  dispatchEvent(new HashChangeEvent("hashchange"));
}

// Changes parts of this page's query without showing it anew; null takes one out. With `push` "back" undoes it.
export function setQuery(changes, push = false) {
  const { path, query } = read();
  const target = link(path.map(encodeURIComponent).join("/"), { ...query, ...changes });
  if (target !== location.hash) history[push ? "pushState" : "replaceState"](null, "", target);
}

// The page of a job: that of its result once it is there.
export const jobPath = ({ id, status, result, result_deleted: isDeleted }) =>
  status === "successful" && !isDeleted ? `results/${result}` : `jobs/${id}`;

// A text for the URL from a value, and back: JSON, deflated, in base64url.
const through = (data, step) => new Response(new Blob([data]).stream().pipeThrough(step));
export async function pack(value) {
  const bytes = await through(
    JSON.stringify(value),
    new CompressionStream("deflate-raw"),
  ).arrayBuffer();
  const text = Array.from(new Uint8Array(bytes), (byte) => String.fromCharCode(byte)).join("");
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

export async function unpack(text) {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (letter) =>
    letter.charCodeAt(0),
  );
  return through(bytes, new DecompressionStream("deflate-raw")).json();
}
