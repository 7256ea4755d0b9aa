'use strict';

/* Definitions of figures: a title, shown at once under the pointer, on keyboard focus and on touch. */
(() => {
  const box = document.createElement('div');
  Object.assign(box, { id: 'definition', hidden: true });
  box.setAttribute('aria-hidden', 'true'); // what it says is the description of the element itself
  document.body.append(box);
  let shown = null;

  /** Takes over the browser's own tooltip, which neither keyboard nor touch reaches. */
  function adopt(element) {
    if (!element.title) return;
    element.dataset.definition = element.title;
    element.setAttribute('aria-description', element.title);
    element.removeAttribute('title');
  }

  function show(element) {
    shown = element;
    box.hidden = !element;
    if (!element) return;
    box.textContent = element.dataset.definition;
    const at = element.getBoundingClientRect(), { width, height } = box.getBoundingClientRect();
    const left = Math.min(Math.max(at.left, 8), document.documentElement.clientWidth - width - 8);
    const below = at.bottom + 6, fits = below + height < window.innerHeight;
    box.style.left = `${Math.max(left, 8)}px`;
    box.style.top = `${fits ? below : Math.max(at.top - height - 6, 8)}px`;
  }

  const defined = (target) => {
    const element = target instanceof Element ? target.closest('[title], [data-definition]') : null;
    if (element) adopt(element);
    return element;
  };
  document.querySelectorAll('.term[title]').forEach(adopt);
  document.addEventListener('pointerover', ({ target }) => show(defined(target)));
  document.addEventListener('focusin', ({ target }) => show(defined(target)));
  document.addEventListener('focusout', () => show(null));
  document.addEventListener('click', ({ target }) => show(defined(target)));
  document.addEventListener('scroll', () => show(null), true);
  document.addEventListener('keydown', ({ key }) => { if (key === 'Escape' && shown) show(null); });
})();
