# The part of api.md that is made of schema/openapi.json, as Markdown: each call and each schema with its tables.

def escaped: gsub("(?<c>[\\\\`*_{}\\[\\]<>#|~&!])"; "\\\(.c)");
def sentence: (.[0:1] | ascii_upcase) + .[1:] | sub("\\.$"; "") | escaped + ".\n";
def anchor: ascii_downcase | gsub("[^a-z0-9 _-]"; "") | gsub(" "; "-");
def code: "`\(.)`";
def listed: map(code) | join(", ");
def meaning: .description // "" | escaped;
def row: "| " + join(" | ") + " |";
def table($names): row, ($names | map("---") | row);

# "list of [Job](#schema-job)", "number [s], at least 0"
def kind:
  if .["$ref"] then .["$ref"] | if startswith("#") then split("/")[-1] | "[\(.)](#\("schema \(.)" | anchor))" else "[\(split("/")[-1])](..\(.))" end
  elif .oneOf or .anyOf then .oneOf // .anyOf | map(kind) | join(" or ")
  elif .type == "array" then "list of " + (.items | kind)
  elif .properties then "object of " + (.properties | keys_unsorted | listed)
  elif (.additionalProperties | type) == "object" then "by name: " + (.additionalProperties | kind)
  elif .enum then .enum | map(tostring | escaped) | join(", ")
  elif has("const") then .const | tostring | escaped
  else ([.type // empty] | flatten | join(" or ")) + (.["x-unit"] // "" | if . == "" then "" else " \\[\(escaped)\\]" end)
    + ([["minimum", "at least"], ["exclusiveMinimum", "above"], ["maximum", "at most"], ["default", "default"]] as $bounds
      | . as $schema | reduce $bounds[] as [$key, $words] (""; . + if $schema | has($key) then ", \($words) \($schema[$key])" else "" end))
  end;

def content: .content // {} | to_entries
  | map(.key as $type | ($type | code) + if $type == "application/json" then ": " + (.value.schema | kind) else "" end) | join(", ");

# Every path may answer 401, 403 and 421; api.md says so once.
def answers($root): .responses | to_entries | sort_by(.key)[] | select(.key | IN("401", "403", "421") | not)
  | .key as $status | .value | if .["$ref"] then $root.components.responses[.["$ref"] | split("/")[-1]] else . end
  | [$status, meaning + (.headers // {} | keys_unsorted | if . == [] then "" else "; headers: " + listed end),
     if $status < "4" then content else "[problem](problems.md)" end] | row;

def call($root; $path; $method):
  "### \($method | ascii_upcase) \($path)\n", (.summary | sentence), (.description // empty | sentence),
  if .security == [] then "Needs no token.\n" else empty end,
  if .parameters then (["parameter", "in", "type", "meaning"] | table(.)), (.parameters[] | [(.name | code), .in, (.schema | kind), meaning] | row), "" else empty end,
  if .requestBody then "Body: \(.requestBody | content).\n" else empty end,
  (["status", "meaning", "content"] | table(.)), answers($root), "";

. as $root
| (.tags[] | .name as $tag | "## \($tag[0:1] | ascii_upcase)\($tag[1:])\n", (.description | sentence),
    ($root.paths | to_entries[] | .key as $path | .value | to_entries[] | .key as $method | .value | select(.tags == [$tag]) | call($root; $path; $method))),
  "## Schemas\n\nThe objects of the answers, by name.\n",
  (.components.schemas | to_entries[] | "### Schema \(.key)\n", (.value | (.description // empty | sentence),
    if .properties then (["member", "type", "meaning"] | table(.)), (.properties | to_entries[] | [(.key | code), (.value | kind), (.value | meaning)] | row) else kind end), "")
