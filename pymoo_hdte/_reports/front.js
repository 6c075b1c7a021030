(() => {
  const figure = document.querySelector("figure.front svg");
  const rows = [...document.querySelectorAll("#front-designs tbody tr")];
  const shown = document.querySelector("#front-shown");
  const points = rows.map((_, row) => document.getElementById("front-point-" + row));
  let current = 0;
  function show(row) {
    points[current].classList.remove("pointed");
    current = Math.max(0, Math.min(rows.length - 1, row));
    points[current].classList.add("pointed");
    const cells = [...rows[current].cells].map((cell) => cell.textContent);
    [...shown.querySelectorAll("td")].forEach((cell, place) => { cell.textContent = cells[place]; });
  }
  function nearest(event) {
    const distances = points.map((point) => {
      const box = point.getBoundingClientRect();
      return Math.hypot(box.x + box.width / 2 - event.clientX, box.y + box.height / 2 - event.clientY);
    });
    return distances.indexOf(Math.min(...distances));
  }
  figure.addEventListener("pointermove", (event) => show(nearest(event)));
  figure.addEventListener("pointerdown", (event) => show(nearest(event)));
  figure.setAttribute("tabindex", "0");
  figure.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (step) { show(current + step); event.preventDefault(); }
  });
  show(Number(shown.dataset.row));
})();
