// What the browser keeps of this page, for good or until the tab is closed. What it refuses lasts as long as the page: it may be
// too much, or a reader may allow nothing.
function makeStorage(areaOf) {
  const refused = new Map();
  const attempt = (act) => {
    try {
      return act(areaOf());
    } catch {
      return null;
    }
  };
  return {
    get: (key) => refused.get(key) ?? attempt((area) => area.getItem(key)),
    set(key, text) {
      refused.set(key, text);
      attempt((area) => area.removeItem(key)); // what was kept before is not valid any more
      attempt((area) => {
        area.setItem(key, text);
        refused.delete(key);
      });
    },
    remove(key) {
      refused.delete(key);
      attempt((area) => area.removeItem(key));
    },
  };
}

export const storage = makeStorage(() => localStorage);
export const tabStorage = makeStorage(() => sessionStorage);
