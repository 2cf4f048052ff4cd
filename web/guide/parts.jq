# Parts of the guide, as Markdown, made of documents in schema/: `scene` of the JSON Schema of scenes, `api` of openapi.json.

def escaped: gsub("(?<c>[\\\\`*_{}\\[\\]<>#|~&!])"; "\\\(.c)");
def sentence: (.[0:1] | ascii_upcase) + .[1:] | sub("\\.$"; "") | escaped + ".\n";
def anchor: ascii_downcase | gsub("[^a-z0-9 _-]"; "") | gsub(" "; "-");
def code: "`\(.)`";
def listed: map(code) | join(", ");
def meaning: .description // "" | escaped;
def row: "| " + join(" | ") + " |";
def table($names): ($names | row), ($names | map("---") | row);

# ", 0 to 1", ", above 0"
def bounds:
  if has("minimum") and has("maximum") then ", \(.minimum) to \(.maximum)"
  elif has("minimum") then ", at least \(.minimum)" elif has("exclusiveMinimum") then ", above \(.exclusiveMinimum)"
  elif has("maximum") then ", at most \(.maximum)" else "" end;
def unit: if .["x-unit"] then " \\[\(.["x-unit"] | escaped)\\]" else "" end;

# "list of [Job](#schema-job)", "number [s], at least 0"
def kind:
  if .["$ref"] then .["$ref"] | if startswith("#") then split("/")[-1] | "[\(.)](#\("schema \(.)" | anchor))" else "[\(split("/")[-1])](..\(.))" end
  elif .oneOf or .anyOf then . as $any | .oneOf // .anyOf | map(. + ($any | {"x-unit"}) | kind) | join(" or ")
  elif .type == "array" then "list of " + (.items + {"x-unit": (.["x-unit"] // .items["x-unit"])} | kind | sub("^(?<word>number|integer|string)"; "\(.word)s"))
  elif .properties then "object of " + (.properties | keys_unsorted | listed)
  elif (.additionalProperties | type) == "object" then "by name: " + (.additionalProperties | kind)
  elif .enum then .enum | map(tostring | escaped) | join(", ")
  elif .pattern // "" | startswith("^(") then .pattern[2:] | split(")")[0] / "|" | join(", ") | escaped
  elif has("const") then .const | tostring | escaped
  else ([.type // empty] | flatten | join(" or ")) + unit + bounds end;

# --- a scene: one section for each object, named by its place: "dampers: buffer" ---

# The object in a member's schema, alone or in a list; it has properties, or kinds with a constant member each.
def object:
  if .anyOf then .anyOf[0] elif .type == "array" then .items else . end | select(.properties or .oneOf) | del(.description);
def parts($place): # its members that are such objects, and theirs
  if .oneOf then .oneOf[] | parts("\($place): \(.title)")
  else .properties | to_entries[] | .key as $key | .value | (object // empty) as $object
    | (if $place == "" then $key else "\($place): \($key)" end) as $inner
    | {name: (if $place != "" then $inner elif $object.oneOf then "\($key): kinds" else "\($key): members" end), $inner, $object, doc: .description},
      ($object | parts($inner)) end;
def fields: .properties | to_entries | map(select(.value | has("const") | not));

def rows($names):
  .required as $required | fields[] | .key as $key | (.value | object // null) as $object
  | [(.key | code),
     (.value | if $object == null then kind
       else "[\(if .type == "array" then "objects" else "object" end)](#\($names[$object | tojson] | anchor))" + if .anyOf | not then "" elif .anyOf[1].type == "null" then " or null"
         else .anyOf[1].description as $text
           | ", or its \(.anyOf[0].properties | to_entries | map(select(.value.description == $text))[0].key | code) alone" end end),
     (if $required | index($key) then "required" elif $object then ""
      else .value.default | if . == null then "" elif type == "array" then join(", ") else tostring end | escaped end),
     (.value | meaning)] | row;
def section($names; $place; $level): # of an object: its members, then the sections of their objects
  (select(fields | length > 0) | table(["member", "type", "default", "meaning"]), rows($names), ""),
  (parts($place) | select(.inner | ltrimstr("\($place): ") | contains(": ") | not) | select($names[.object | tojson] == .name)
    | . as $part | "\("######"[0:$level]) \(.name)\n", (.doc | sentence), (.object
    | if .oneOf | not then section($names; $part.inner; [$level + 1, 6] | min)
      else (.oneOf | map(fields) | unique | length == 1) as $is_shared
        | (.oneOf[0].properties | to_entries | map(select(.value | has("const")))[0].key) as $tag
        | table([$tag, "meaning"]),
          (.oneOf | to_entries[] | [(.value.title | if $is_shared then code else "[\(.)](#\("\($part.inner): \(.)" | anchor))" end),
            (.value | meaning) + if .key == 0 and (.value.required | index($tag) | not) then " (default)" else "" end] | row), "",
          if $is_shared then .oneOf[0] | section($names; $part.inner; $level + 1)
          else .oneOf[] | "\("######"[0:$level + 1]) \($part.inner): \(.title)\n", (.description | sentence), section($names; "\($part.inner): \(.title)"; $level + 2) end
      end));
def scene:
  (reduce parts("") as $part ({}; ($part.object | tojson) as $key | if has($key) then . else .[$key] = $part.name end)) as $names
  | "## All members\n", section($names; ""; 2);

# --- the API: each call and each schema with its tables ---

def content: .content // {} | to_entries
  | map(.key as $type | ($type | code) + if $type == "application/json" then ": " + (.value.schema | kind) else "" end) | join(", ");
def defaulted: kind + if has("default") then ", default \(.default)" else "" end;

# Every path may answer 401, 403 and 421; api.md says so once.
def answers($root): .responses | to_entries | sort_by(.key)[] | select(.key | IN("401", "403", "421") | not)
  | .key as $status | .value | if .["$ref"] then $root.components.responses[.["$ref"] | split("/")[-1]] else . end
  | [$status, meaning + (.headers // {} | keys_unsorted | if . == [] then "" else "; headers: " + listed end),
     if $status < "4" then content else "[problem](problems.md)" end] | row;

def call($root; $path; $method):
  "### \($method | ascii_upcase) \($path)\n", (.summary | sentence), (.description // empty | sentence),
  if .security == [] then "Needs no token.\n" else empty end,
  if .parameters then table(["parameter", "in", "type", "meaning"]), (.parameters[] | [(.name | code), .in, (.schema | defaulted), meaning] | row), "" else empty end,
  if .requestBody then "Body: \(.requestBody | content).\n" else empty end,
  table(["status", "meaning", "content"]), answers($root), "";

def api: . as $root
| (.tags[] | .name as $tag | "## \($tag[0:1] | ascii_upcase)\($tag[1:])\n", (.description | sentence),
    ($root.paths | to_entries[] | .key as $path | .value | to_entries[] | .key as $method | .value | select(.tags == [$tag]) | call($root; $path; $method))),
  "## Schemas\n\nThe objects of the answers, by name.\n",
  (.components.schemas | to_entries[] | "### Schema \(.key)\n", (.value | (.description // empty | sentence),
    if .properties then table(["member", "type", "meaning"]), (.properties | to_entries[] | [(.key | code), (.value | defaulted), (.value | meaning)] | row) else kind end), "");
