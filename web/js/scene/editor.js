// The drawing of a scene that is edited, with its handles, as wide as there is room.
import { html, useRef, useState } from "../ui/preact.js";
import { useNews } from "../form/draft.js";
import { useWidth } from "../ui/width.js";
import { Picture } from "./drawing.js";
import { Handles } from "./handles.js";
import { layoutOf } from "./layout.js";
import { modelOf, MOST_DAMPERS, MOST_STOREYS } from "./model.js";

// While something is dragged the scale stays what it was.
export function SceneDrawing({ draft, history }) {
  useNews(draft);
  const box = useRef(null);
  const width = useWidth(box, 250, 720);
  const [fixed, setFixed] = useState(null);
  const model = modelOf(draft.scene, draft.check?.plan);
  const layout = width > 0 && layoutOf(model, { width, fixed });
  const onDrag = (isDragging) => setFixed(isDragging ? layout.scale : null);
  const cut = model.isCut
    ? ` At most ${MOST_STOREYS} storeys and ${MOST_DAMPERS} dampers are drawn.`
    : "";
  return html`<div class="drawing" ref=${box}>
    ${
      layout &&
      html`<div class="drawing-stage">
        <${Picture} model=${model} layout=${layout} />
        <${Handles} edit=${{ draft, history, onDrag }} model=${model} layout=${layout} />
      </div>`
    }
    <p class="hint">
      ${`Drag a stop, the ball's rim, a pad (e up, contact time to the side) or the start. Lengths are to scale.${cut}`}
    </p>
  </div>`;
}
