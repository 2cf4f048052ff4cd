// Ids of elements: each word with a number of its own.
let count = 0;
export const freshId = (word) => `${word}-${++count}`;
