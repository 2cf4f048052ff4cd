// A sentence for those who listen to the page rather than see it.
export function announce(text) {
  document.getElementById("announcer").textContent = text;
}
