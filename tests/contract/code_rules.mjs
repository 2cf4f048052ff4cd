// Says where modules break rules that a formatter cannot keep: no ternary directly within another, no assignment within an
// expression. Arguments: prettier's folder (its parser is used), modules. A line "file:line: what" for each.
import fs from "node:fs";
import { pathToFileURL } from "node:url";

const [library, ...files] = process.argv.slice(2);
const { parsers } = await import(pathToFileURL(`${library}/plugins/acorn.mjs`));

const isNode = (value) => typeof value?.type === "string";
const children = (node) => Object.values(node).flat().filter(isNode);
const mayAssign = ({ type }, node, parent) =>
  type === "ExpressionStatement" || (type === "ForStatement" && node !== parent.test);

function walk(node, parent, text, found) {
  const line = text.slice(0, node.range?.[0] ?? node.start).split("\n").length;
  if (node.type === "ConditionalExpression" && parent.type === "ConditionalExpression")
    found.push(`${line}: a ternary within another`);
  if (node.type === "AssignmentExpression" && !mayAssign(parent, node, parent))
    found.push(`${line}: an assignment within an expression`);
  for (const child of children(node)) walk(child, node, text, found);
}

for (const file of files) {
  const found = [];
  const text = fs.readFileSync(file, "utf8");
  walk(parsers.acorn.parse(text, { filepath: file }), {}, text, found);
  for (const fault of found) console.log(`${file}:${fault}`);
}
