"use strict";
// a click on a heading sorts the table by its column, another click the other way; empty cells stay last
function orderOf(cell) {
  const number = cell.dataset.order;
  if (number !== undefined) return number === "" ? null : Number(number);
  return cell.textContent.trim() || null;
}
function sortBy(table, column, down) {
  const sign = down ? -1 : 1;
  const rows = Array.from(table.tBodies[0].rows, (row) => [orderOf(row.cells[column]), row]);
  rows.sort(([a], [b]) => {
    if (a === null || b === null) return (a === null) - (b === null);
    return sign * (typeof a === "number" ? a - b : a.localeCompare(b, "en", { numeric: true }));
  });
  table.tBodies[0].append(...rows.map(([, row]) => row));
}
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = Array.from(table.tHead.rows[0].cells);
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      sortBy(table, column, down);
    });
  });
}
