'use strict';

/* Sorts a table by a column: its heading is a button. A second press turns the order; undefined is always last. */
(() => {
  /** The number that a cell stands for, or its text. */
  function value(row, column) {
    const cell = row.cells[column], holder = cell.dataset.value === undefined ? cell.querySelector('[data-value]') : cell;
    if (!holder) return cell.textContent.trim();
    return holder.dataset.value === '' ? NaN : Number(holder.dataset.value);
  }

  function compare(a, b) {
    return typeof a === 'string' ? a.localeCompare(b, undefined, { numeric: true }) : a - b;
  }

  function sort(table, heading) {
    const body = table.tBodies[0], rows = [...body.rows], column = heading.cellIndex;
    const way = heading.getAttribute('aria-sort') === 'ascending' ? -1 : 1;
    const keyed = rows.map((row) => ({ row, key: value(row, column) }));
    const unknown = ({ key }) => Number.isNaN(key);
    keyed.sort((a, b) => unknown(a) - unknown(b) || (unknown(a) ? 0 : way * compare(a.key, b.key)));
    body.append(...keyed.map(({ row }) => row));
    for (const other of heading.parentElement.cells) other.removeAttribute('aria-sort');
    heading.setAttribute('aria-sort', way > 0 ? 'ascending' : 'descending');
  }

  for (const table of document.querySelectorAll('table.sorted')) {
    for (const heading of table.tHead.rows[0].cells) {
      const button = document.createElement('button');
      button.type = 'button';
      button.append(...heading.childNodes);
      heading.append(button);
      button.addEventListener('click', () => sort(table, heading));
    }
  }
})();
