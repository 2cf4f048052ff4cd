// What a reader takes along: files in every format, and lines that run this scene elsewhere.
import { address, save } from "./api.js";
import { copied, failure, figures, folded, h } from "./dom.js";
import { title } from "./units.js";

export const section = { title: "Take it along", show };

function show(host, { result: { id, links, scene } }) {
  const files = Map.groupBy(Object.values(links).map((path) => /^[^{]+\/((\w+)\.(\w+))$/.exec(path)).filter(Boolean),
    ([, , what]) => what);
  const file = ([path, name, , format]) => [h("a", { href: address(path), "aria-label": name, onclick(event) {
    event.preventDefault();
    save(path, `${id.slice(0, 10)}_${name}`).catch((error) => event.target.after(failure(error)));
  } }, format), " "];
  // Apostrophes, which only stand in texts, are escaped: so any language can quote it.
  const text = JSON.stringify(scene, null, 2).replaceAll("'", "\\u0027"), url = address("").replace(/\/$/, "");
  host.append(figures([...files].map(([what, all]) => [title(what), all.map(file)])), ...Object.entries(languages(url, text)).map(([name, lines]) =>
    folded(`Run this scene from ${name}`, () => copied(lines))));
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
