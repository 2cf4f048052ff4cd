// The series of a long result at any instant: pieces are asked for as they are needed, the next one ahead of time.
import { get } from "../api.js";

const NUMBERS = 6000; // of a piece, few so that the first one comes soon
const KEPT = 4;

export class Pieces {
  pieces = new Map(); // by their index: {start, channels} once they are here, null before
  // `onChange()` is called when a piece has come, `onError(error)` when it did not.
  constructor({ path, channels, rate, signal, onChange, onError }) {
    Object.assign(this, { path, channels, rate, signal, onChange, onError });
    this.length = Math.max(1, Math.floor(NUMBERS / channels.length)) / rate; // s
  }

  request(index) {
    if (index < 0 || this.pieces.has(index)) return;
    this.pieces.set(index, null);
    if (this.pieces.size > KEPT) this.pieces.delete(this.pieces.keys().next().value);
    const from = index * this.length;
    const to = from + this.length + 1 / this.rate; // with the next one's first sample
    get(`${this.path}/series.json`, { channels: this.channels.join(), from, to }, this.signal).then(
      (piece) => {
        this.pieces.set(index, piece);
        this.onChange();
      },
      (error) => {
        this.pieces.delete(index);
        if (error.name !== "AbortError") this.onError(error);
      },
    );
  }

  // The value of a channel at an instant, between its samples on a line; undefined where it is not here yet.
  value(channel, instant) {
    const piece = this.pieces.get(Math.floor(instant / this.length));
    if (!piece) return undefined;
    const { values } = piece.channels[channel];
    const place = Math.min(values.length - 1, Math.max(0, (instant - piece.start) * this.rate));
    const low = Math.floor(place);
    return values[low] + (place - low) * ((values[low + 1] ?? values[low]) - values[low]);
  }

  // Whether the instant is here; asks for its piece and, near its end, for the next one.
  has(instant, end) {
    const index = Math.floor(instant / this.length);
    this.request(index);
    const next = (index + 1) * this.length;
    if (next - instant < this.length / 2 && next < end) this.request(index + 1);
    return Boolean(this.pieces.get(index));
  }
}
