// A scene's channels by name: where there are several storeys or dampers, each has its number.
export const storeyCount = ({ structure } = {}) =>
  [structure?.masses ?? structure?.mass].flat().length;

// (word, number) -> "displacement", or "displacement_2".
export function channelNamer({ structure, dampers = [] }) {
  const isNumbered = storeyCount({ structure }) > 1 || dampers.length > 1;
  return (word, number) => (isNumbered ? `${word}_${number}` : word);
}
