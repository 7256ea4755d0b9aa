'use strict';

/* Shows the claims of a verdict, and those that have some words. */
(() => {
  const form = document.getElementById('filter'), verdict = document.getElementById('verdict');
  const words = document.getElementById('words'), shown = document.getElementById('shown');
  const claims = [...document.querySelectorAll('.claim')];

  function apply() {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean), active = wanted.length > 0 || verdict.value;
    let number = 0;
    for (const claim of claims) {
      const text = claim.textContent.toLowerCase();
      const fits = (!verdict.value || claim.dataset.verdict === verdict.value) && wanted.every((word) => text.includes(word));
      claim.hidden = !fits;
      number += fits;
    }
    for (const item of document.querySelectorAll('.item')) {
      item.hidden = Boolean(active) && !item.querySelector('.claim:not([hidden])');
      const entry = document.querySelector(`nav a[href="#${CSS.escape(item.id)}"]`);
      if (entry) entry.parentElement.hidden = item.hidden;
    }
    shown.textContent = active ? `${number} of ${claims.length} claims` : '';
  }

  form.hidden = false;
  form.addEventListener('submit', (event) => event.preventDefault());
  verdict.addEventListener('change', apply);
  words.addEventListener('input', apply);
  apply();
})();
