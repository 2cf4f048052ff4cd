// What a reader takes along: files in every format, and lines that run this scene elsewhere.
import { html } from "../ui/preact.js";
import { address } from "../api.js";
import { save } from "../ui/files.js";
import { CodeBlock, Figures } from "../ui/controls.js";
import { title } from "../units.js";
import { useResult } from "./context.js";

// Links of the answer by what they hold: Map of "series" to [{path, name, format}].
function filesOf(links) {
  const files = Object.values(links)
    .map((path) => /^[^{]+\/((\w+)\.(\w+))$/.exec(path))
    .filter(Boolean)
    .map(([path, name, part, format]) => ({ path, name, part, format }));
  return Map.groupBy(files, ({ part }) => part);
}

export function Files() {
  const { result } = useResult();
  const { id, links, scene } = result;
  // Apostrophes, which only stand in texts, are escaped: so any language can quote it.
  const text = JSON.stringify(scene, null, 2).replaceAll("'", "\\u0027");
  const url = address("").replace(/\/$/, "");
  const take = (file) => async (event) => {
    event.preventDefault();
    await save(file.path, `${id.slice(0, 10)}_${file.name}`);
  };
  const pairs = [...filesOf(links)].map(([part, files]) => [
    title(part),
    files.map(
      (file) =>
        html`<a href=${address(file.path)} aria-label=${file.name} onClick=${take(file)}
            >${file.format}</a
          >${" "}`,
    ),
  ]);
  return html`<${Figures} pairs=${pairs} /> ${Object.entries(languages(url, text)).map(
      ([name, lines]) =>
        html`<details>
          <summary>Run this scene from ${name}</summary>
          <${CodeBlock} text=${lines} />
        </details>`,
    )}`;
}

const languages = (url, scene) => ({
  curl: `url=${url}
ask() { curl -sS --fail-with-body -H "Authorization: Bearer $IMPACTD_TOKEN" "$@"; }
cat >scene.json <<'SCENE'\n${scene}\nSCENE
job=$(ask --json @scene.json "$url/v1/jobs" | jq -r .id)
until ask "$url/v1/jobs/$job?wait=20" -o job.json && jq -e .finished job.json >/dev/null; do sleep 1; done
jq '.summary // .problem' job.json
ask "$url/v1/results/$(jq -r .result job.json)/series.csv" -o series.csv
`,
  Python: `import io, json, os, numpy, requests
url = "${url}"
scene = json.loads(r'''${scene}''')
session = requests.Session()
session.headers["Authorization"] = "Bearer " + os.environ.get("IMPACTD_TOKEN", "")
job = session.post(url + "/v1/jobs", json=scene).json()
while job["status"] in ("accepted", "running"):
    job = session.get(f"{url}/v1/jobs/{job['id']}?wait=20").json()
series = numpy.load(io.BytesIO(session.get(f"{url}/v1/results/{job['result']}/series.npz").content))
print(job["summary"], series.files)
`,
  MATLAB: `url = '${url}';
options = weboptions('MediaType', 'application/json', 'ContentType', 'json', 'Timeout', 60, ...
  'HeaderFields', {'Authorization', ['Bearer ' getenv('IMPACTD_TOKEN')]});
scene = [ ...\n${scene.replace(/.+/g, "  '$&' ...")}\n];
job = webwrite([url '/v1/jobs'], scene, options);
while any(strcmp(job.status, {'accepted', 'running'}))
  job = webread([url '/v1/jobs/' job.id '?wait=20'], options);
end
disp(job.summary)
websave('series.mat', [url '/v1/results/' job.result '/series.mat'], options);
series = load('series.mat')
`,
});
