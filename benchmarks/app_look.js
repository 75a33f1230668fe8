// What a page looks like: called once for each audit, see app_look.py.
(() => {
    const CONTROLS = 'button, a[href], input, textarea, select, .cursor-pointer, ' +
        ['button', 'checkbox', 'link', 'menuitem', 'radio', 'slider', 'switch', 'tab']
            .map(role => `[role=${role}]`).join(', ');
    // a control is made of elements inside one of these
    const WHOLE = '.q-field, .q-slider, .q-checkbox, .q-toggle, .q-btn, .q-item, tr';
    const isShown = e => e.checkVisibility({opacityProperty: true, visibilityProperty: true})
        && e.getBoundingClientRect().width > 1 && e.getBoundingClientRect().height > 1;
    const isOff = e => e.closest('[disabled], .disabled, [aria-disabled=true]') !== null;
    const said = e => {
        const text = e.getAttribute('aria-label') || e.innerText || e.textContent || e.value || '';
        return `${e.tagName.toLowerCase()} ${text.trim().slice(0, 40)}`.replace(/\s+/g, ' ').trim();
    };
    // what is open over a page hides it
    const scope = () => document.querySelector('.q-menu') || document.querySelector('.q-dialog')
        || document.body;
    const controls = () => [...scope().querySelectorAll(CONTROLS)].filter(e =>
        isShown(e) && !isOff(e) && e.type !== 'file' && !e.closest('.js-plotly-plot, [inert]'));
    const texts = () => {
        const all = [], walker = document.createTreeWalker(scope(), NodeFilter.SHOW_TEXT);
        while (walker.nextNode()) {
            const node = walker.currentNode, e = node.parentElement;
            if (!node.data.trim() || e.closest('script, style, .q-notifications, .q-tooltip')) continue;
            if (!isShown(e)) continue;
            const range = document.createRange();
            range.selectNodeContents(node);
            all.push([e, range]);
        }
        return all;
    };

    // --- colours -----------------------------------------------------------------------------
    const canvas = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
    const rgba = colour => {
        const plain = colour.match(/^rgba?\(([\d.]+), ([\d.]+), ([\d.]+)(?:, ([\d.]+))?\)$/);
        if (plain) return plain.slice(1).map((part, n) => n === 3 && part === undefined ? 1 : +part);
        canvas.clearRect(0, 0, 1, 1);
        canvas.fillStyle = colour;
        canvas.fillRect(0, 0, 1, 1);
        const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
        return [r, g, b, a / 255];
    };
    const over = (top, below) => below.map((part, n) => top[n] * top[3] + part * (1 - top[3]));
    const luminance = rgb => rgb
        .map(part => part / 255)
        .map(part => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4)
        .reduce((sum, part, n) => sum + part * [0.2126, 0.7152, 0.0722][n], 0);
    const ratio = (one, other) => {
        const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
        return (high + 0.05) / (low + 0.05);
    };
    const background = e => {
        const layers = [];
        for (let at = e; at; at = at.parentElement) {
            const layer = rgba(getComputedStyle(at).backgroundColor);
            if (layer[3]) layers.push(layer);
            if (layer[3] === 1) break;
        }
        return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255]);
    };
    const opacity = e => {
        let product = 1;
        for (let at = e; at; at = at.parentElement) product *= +getComputedStyle(at).opacity;
        return product;
    };
    const contrast = (e, colour, more = 1) => {
        const [r, g, b, a] = rgba(colour), below = background(e);
        return ratio(over([r, g, b, a * opacity(e) * more], below), below);
    };

    const colours = () => {
        const all = [];
        for (const [e] of texts()) {
            if (isOff(e)) continue;
            const style = getComputedStyle(e), isIcon = e.closest('.q-icon') !== null;
            const size = parseFloat(style.fontSize), bold = +style.fontWeight >= 700;
            const least = isIcon || size >= 24 || (bold && size >= 18.66) ? 3 : 4.5;
            const colour = e instanceof SVGElement ? style.fill : style.color;
            all.push([isIcon ? 'icon' : 'text', contrast(e, colour), least, said(e)]);
        }
        for (const e of scope().querySelectorAll('input, textarea')) {
            if (!isShown(e) || isOff(e) || e.type === 'file') continue;
            const part = e.value ? undefined : '::placeholder';
            if (part && !e.placeholder) continue;
            const style = getComputedStyle(e, part);
            all.push(['text', contrast(e, style.color, part ? +style.opacity : 1), 4.5, said(e)]);
        }
        const drawn = '.scatterlayer .js-line, .scatterlayer .point, .shapelayer path';
        for (const e of document.querySelectorAll(`.js-plotly-plot :is(${drawn})`)) {
            const style = getComputedStyle(e);
            // what is not fitted is shaded: nothing is read from it
            if (!isShown(e) || (style.stroke === 'none' || +style.strokeWidth.replace('px', '') === 0)
                && style.fill === 'none') continue;
            if (e.closest('.shapelayer') && parseFloat(style.strokeWidth) === 0) continue;
            const colour = style.stroke !== 'none' && parseFloat(style.strokeWidth) > 0
                ? style.stroke : style.fill;
            const more = style.stroke !== 'none' ? +style.strokeOpacity : +style.fillOpacity;
            all.push(['line', contrast(e, colour, more), 3, `plot ${e.getAttribute('class')}`]);
        }
        return all;
    };

    // --- places ------------------------------------------------------------------------------
    const faults = () => {
        const all = [], root = document.scrollingElement, wide = root.clientWidth;
        if (root.scrollWidth > wide + 1) all.push(`scrolls sideways: ${root.scrollWidth} > ${wide}`);
        const within = (e, left, right, top, bottom) => {
            if (right > wide + 1 || left < -1) {
                for (let at = e; at; at = at.parentElement) {
                    if (/auto|scroll/.test(getComputedStyle(at).overflowX)) return '';
                }
                return 'beyond the window';
            }
            for (let at = e; at && at !== document.body; at = at.parentElement) {
                const style = getComputedStyle(at), box = at.getBoundingClientRect();
                if (/auto|scroll/.test(style.overflowX + style.overflowY)) return '';
                if (/hidden|clip/.test(style.overflowX) && right > box.right + 2) return 'cut off';
                if (/hidden|clip/.test(style.overflowY) && bottom > box.bottom + 3) return 'cut off';
            }
            return '';
        };
        for (const [e, range] of texts()) {
            const box = range.getBoundingClientRect();
            const fault = within(e, box.left, box.right, box.top, box.bottom);
            if (fault) all.push(`${fault}: ${said(e)}`);
            if (!(e instanceof SVGElement) && box.width < 90
                && box.height > 5 * parseFloat(getComputedStyle(e).fontSize)) {
                all.push(`squeezed: ${said(e)}`);
            }
        }
        for (const e of scope().querySelectorAll('img, .js-plotly-plot, input, textarea, button')) {
            if (!isShown(e)) continue;
            const box = e.getBoundingClientRect();
            const fault = within(e, box.left, box.right, box.top, box.bottom);
            if (fault) all.push(`${fault}: ${said(e)}`);
            if (e.tagName === 'INPUT' && e.type !== 'file' && e.scrollWidth > e.clientWidth + 2) {
                all.push(`cut off: ${said(e)}`);
            }
        }
        // what is pointed at must be there, and not below something else
        const points = texts().map(([e, range]) => [e, range]);
        for (const e of controls()) points.push([e, e]);
        for (const [e, where] of points) {
            if (e instanceof SVGElement || e.closest('.q-slider')) continue;
            e.scrollIntoView({block: 'center'});
            const box = where.getBoundingClientRect();
            const x = box.left + box.width / 2, y = box.top + box.height / 2;
            const hit = document.elementFromPoint(x, y);
            const same = hit && (e.contains(hit) || hit.contains(e) || hit.closest('label')
                && hit.closest('label') === e.closest('label')
                || hit && e.closest('.q-btn') && hit.closest('.q-btn') === e.closest('.q-btn'));
            if (!same && e.closest('.q-field') === (hit && hit.closest('.q-field'))
                && e.closest('.q-field')) continue;
            if (!same && x >= 0 && x < wide) all.push(`covered: ${said(e)} by ${hit && said(hit)}`);
        }
        const boxes = texts().filter(([e]) => e instanceof SVGElement)
            .map(([e, range]) => [e, range.getBoundingClientRect()]);
        boxes.forEach(([e, one], n) => boxes.slice(n + 1).forEach(([other, two]) => {
            if (e.closest('svg') !== other.closest('svg')) return;
            const across = Math.min(one.right, two.right) - Math.max(one.left, two.left);
            const down = Math.min(one.bottom, two.bottom) - Math.max(one.top, two.top);
            if (across > 2 && down > 4) all.push(`overlap: ${said(e)} and ${said(other)}`);
        }));
        scrollTo(0, 0);
        return [...new Set(all)];
    };

    // --- keyboard ----------------------------------------------------------------------------
    const outlined = e => {
        for (let at = e; at && at !== document.body; at = at.parentElement) {
            const style = getComputedStyle(at);
            if (style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2) {
                return contrast(at.parentElement, style.outlineColor);
            }
            if (at.matches(WHOLE)) break;
        }
        return 0;
    };
    const focused = () => {
        const e = document.activeElement;
        if (!e || e === document.body) return [];
        if (e.dataset.reached) return null;
        e.dataset.reached = 1;
        if (!isShown(e) && !e.closest(WHOLE)) return [said(e), 0, 'hidden'];
        const box = (e.closest(WHOLE) || e).getBoundingClientRect();
        const x = box.left + box.width / 2, y = box.top + box.height / 2;
        const hit = document.elementFromPoint(x, y), whole = e.closest(WHOLE) || e;
        const seen = hit && (whole.contains(hit) || hit.contains(whole));
        return [said(e), outlined(e), seen ? '' : `covered by ${hit && said(hit)}`];
    };
    const unreached = () => controls().filter(e => {
        const whole = e.closest(WHOLE) || e;
        return !whole.dataset.reached && !whole.querySelector('[data-reached]')
            && !e.closest('[data-reached]');
    }).map(said);
    const forget = () => document.querySelectorAll('[data-reached]').forEach(e => {
        delete e.dataset.reached;
    });
    const unfolded = () => {
        const closed = [...document.querySelectorAll('.q-expansion-item--collapsed')].filter(isShown);
        closed.forEach(e => e.querySelector('[role=button], .q-item').click());
        return closed.length;
    };
    return {colours, faults, focused, unreached, forget, unfolded};
})()
