// The value under the cursor, read back from the drawn line; without scripts the page lacks only that.
for (const plot of document.querySelectorAll(".plot[data-end]")) {
  const area = plot.querySelector(".area"), said = plot.querySelector("output");
  const end = +plot.dataset.end, bottom = +plot.dataset.bottom, top_ = +plot.dataset.top;
  const lines = [...plot.querySelectorAll("polyline")].map(line => ({
    name: line.dataset.name,
    points: line.getAttribute("points").split(" ").filter(Boolean).map(pair => pair.split(",").map(Number)),
  }));
  const cursor = document.createElement("div");
  cursor.className = "cursor"; cursor.hidden = true; area.append(cursor);
  const show = event => {
    const box = area.getBoundingClientRect(), share = (event.clientX - box.left) / box.width;
    if (share < 0 || share > 1) return hide();
    cursor.hidden = false; cursor.style.left = 100 * share + "%";
    const words = lines.filter(line => line.points.length).map(line => {
      let best = line.points[0];
      for (const point of line.points) if (Math.abs(point[0] - 720 * share) < Math.abs(best[0] - 720 * share)) best = point;
      const value = bottom + (1 - best[1] / 100) * (top_ - bottom);
      return (lines.length > 1 ? line.name + " " : "") + value.toPrecision(3);
    });
    said.textContent = (share * end).toFixed(2) + " s: " + words.join(", ");
  };
  const hide = () => { cursor.hidden = true; said.textContent = ""; };
  area.addEventListener("pointermove", show); area.addEventListener("pointerdown", show); area.addEventListener("pointerleave", hide);
}
