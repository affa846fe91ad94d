// The explorer of rides: panels over distance that share their zoom, drawn on canvases from data in the page.
// Series are the extremes of bins ("y", two to a bin) or their ranges ("low", "high", and "mean" if there is one).
"use strict";
(() => {
  const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // Colours of series: their own, or the page's for the truth, the design and what uses no IMU.
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const hue = look => look.colour.startsWith("#") ? dark.matches && look.night || look.colour : css(`--${look.colour || "ink"}`);
  const make = (tag, settings = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), settings);
    element.append(...children);
    return element;
  };
  const LEFT = 62, RIGHT = 10, TOP = 6, BOTTOM = 8, AXIS = 30;

  // ---- numbers ---------------------------------------------------------------------------------------------
  const decoded = new Map();
  // The least of them, a step, and how many steps of it each is above the least, in 16 bits; 65535 is nothing.
  const numbers = held => {
    if (!decoded.has(held)) {
      const [low, step, text] = held, steps = new Uint16Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
      decoded.set(held, Float64Array.from(steps, count => count < 65535 ? low + step * count : NaN));
    }
    return decoded.get(held);
  };
  const ticks = (low, high, most) => {
    const raw = (high - low) / most, ten = 10 ** Math.floor(Math.log10(raw));
    const at = [1, 2, 5, 10].findIndex(k => k * ten >= raw);
    let step, marks = [];
    // One mark alone says nothing of the scale: then the next finer step.
    for (let k = at < 0 ? 3 : at; marks.length < 2 && k > at - 3; k--) {
      step = ten * (k < 0 ? [0.1, 0.2, 0.5][k + 3] : [1, 2, 5, 10][k]);
      marks = [];
      for (let i = Math.ceil(low / step); i * step <= high + 1e-9 * step; i++) marks.push(i * step);
    }
    return [marks, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
  };
  const short = value => Number.isFinite(value) ? String(+value.toPrecision(3)).replace("-", "\u2212") : "\u2013";

  // ---- a pen that writes SVG, with the few strokes of a canvas that are used here ------------------------------
  class SvgPen {
    constructor(prefix) { this.out = []; this.dash = ""; this.prefix = prefix; this.clips = 0; }
    beginPath() { this.d = ""; }
    moveTo(x, y) { this.d += `M${x.toFixed(1)} ${y.toFixed(1)}`; }
    lineTo(x, y) { this.d += `L${x.toFixed(1)} ${y.toFixed(1)}`; }
    closePath() { this.d += "Z"; }
    setLineDash(dash) { this.dash = dash.length ? ` stroke-dasharray="${dash}"` : ""; }
    path(look) { this.out.push(`<path d="${this.d}" opacity="${this.globalAlpha ?? 1}" ${look}/>`); }
    stroke() { this.path(`fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}"${this.dash}`); }
    fill() { this.path(`fill="${this.fillStyle}"`); }
    fillRect(x, y, w, h) { this.out.push(`<rect x="${x}" y="${y}" width="${w}" height="${h}" fill="${this.fillStyle}"/>`); }
    fillText(text, x, y) {
      const anchor = {right: "end", center: "middle"}[this.textAlign] || "start";
      const safe = text.replace(/&/g, "&amp;").replace(/</g, "&lt;");
      this.out.push(`<text x="${x}" y="${y}" text-anchor="${anchor}" font-size="11" fill="${this.fillStyle}">${safe}</text>`);
    }
    inside(x, y, w, h, draw) {
      const id = `${this.prefix}-${++this.clips}`;
      this.out.push(`<clipPath id="${id}"><rect x="${x}" y="${y}" width="${w}" height="${h}"/></clipPath><g clip-path="url(#${id})">`);
      draw();
      this.out.push("</g>");
    }
  }
  const insideOf = context => (x, y, w, h, draw) => {
    context.save();
    context.beginPath();
    context.rect(x, y, w, h);
    context.clip();
    draw();
    context.restore();
  };

  const download = (name, text) => {
    const link = make("a", {download: name, href: URL.createObjectURL(new Blob([text], {type: "image/svg+xml"}))});
    link.click();
    URL.revokeObjectURL(link.href);
  };

  // ---- one panel -------------------------------------------------------------------------------------------
  const rangeOf = (view, panel, looks, shown, [from, to]) => {
    let low = Infinity, high = -Infinity;
    // Scaled to what is no baseline, if any is shown: a baseline may leave the panel.
    const all = panel.series.filter(one => shown(one.key));
    const leading = all.filter(one => looks[one.key].kind !== "baseline");
    for (const one of leading.length ? leading : all) {
      for (const name of one.y ? ["y"] : ["low", "high"]) {
        const y = numbers(one[name]), x = numbers(view.axes[panel.axis][name === "y" ? "x2" : "x"]);
        for (let i = 0; i < y.length; i++) {
          if (x[i] >= from && x[i] <= to && Number.isFinite(y[i])) {
            if (y[i] < low) low = y[i];
            if (y[i] > high) high = y[i];
          }
        }
      }
    }
    if (!(low <= high)) return [-1, 1];
    const room = 0.06 * (high - low) || 0.5 * Math.abs(high) || 1;
    return [low - room, high + room];
  };

  const draw = (pen, view, panel, looks, shown, zoom, wide, tall, isFirst, isLast) => {
    const [from, to] = zoom, [low, high] = rangeOf(view, panel, looks, shown, zoom);
    const bottom = tall - BOTTOM - (isLast ? AXIS : 0), right = wide - RIGHT;
    const px = x => LEFT + (x - from) / (to - from) * (right - LEFT);
    const py = y => TOP + (high - y) / (high - low) * (bottom - TOP);
    const ink = css("--ink"), muted = css("--muted");
    pen.inside(LEFT, TOP, right - LEFT, bottom - TOP, () => {
      for (const place of view.places) {
        const a = Math.max(px(place.start), LEFT), b = Math.min(px(place.end), right);
        if (b <= a) continue;
        pen.fillStyle = css(place.kind === "curve" ? "--curve" : "--transition");
        pen.fillRect(a, TOP, b - a, bottom - TOP);
        const words = [place.words, place.words.replace(/ \w+$/, "")].find(text => 6.2 * text.length < b - a);
        if (isFirst && words) {
          pen.fillStyle = muted;
          pen.textAlign = "center";
          pen.fillText(words, (a + b) / 2, TOP + 12);
        }
      }
    });
    pen.textAlign = "right";
    pen.lineWidth = 1;
    pen.setLineDash([]);
    const [marks, decimals] = ticks(low, high, tall > 100 ? 5 : 3);
    for (const mark of marks) {
      pen.strokeStyle = css(Math.abs(mark) < 1e-12 * (high - low) ? "--axis" : "--line");
      pen.beginPath();
      pen.moveTo(LEFT, py(mark));
      pen.lineTo(right, py(mark));
      pen.stroke();
      pen.fillStyle = ink;
      pen.fillText((Math.abs(mark) < 1e-9 ? 0 : mark).toFixed(decimals).replace("-", "\u2212"), LEFT - 6, py(mark) + 4);
    }
    const [along, places] = ticks(from, to, Math.max(3, wide / 130));
    for (const mark of along) {
      pen.strokeStyle = css("--line");
      pen.beginPath();
      pen.moveTo(px(mark), TOP);
      pen.lineTo(px(mark), bottom);
      pen.stroke();
      if (isLast) {
        pen.textAlign = "center";
        pen.fillStyle = ink;
        pen.fillText(mark.toFixed(places), px(mark), bottom + 15);
      }
    }
    if (isLast) {
      pen.textAlign = "right";
      pen.fillStyle = muted;
      const arrow = {"1": "  travel \u2192", "-1": "  \u2190 travel"}[view.travel] || "";
      pen.fillText(view.along + arrow, right, bottom + 31);
    }
    pen.inside(LEFT, TOP, right - LEFT, bottom - TOP, () => {
      // The truth comes last, a thin line above all others.
      const last = one => looks[one.key].kind === "truth" ? 2 : looks[one.key].kind === "test" ? 1 : 0;
      for (const one of [...panel.series].sort((a, b) => last(a) - last(b))) {
        if (!shown(one.key)) continue;
        const look = looks[one.key], colour = hue(look);
        const x = numbers(view.axes[panel.axis].x);
        if (one.low) {
          const below = numbers(one.low), above = numbers(one.high);
          pen.globalAlpha = look.kind === "baseline" ? 0.4 : 0.22;
          pen.fillStyle = colour;
          pen.beginPath();
          let run = [];
          const close = () => {
            if (run.length) pen.moveTo(px(x[run[0]]), py(above[run[0]]));
            for (const i of run) pen.lineTo(px(x[i]), py(above[i]));
            for (const i of run.reverse()) pen.lineTo(px(x[i]), py(below[i]));
            if (run.length) pen.closePath();
            run = [];
          };
          for (let i = 0; i < x.length; i++) Number.isFinite(x[i] + below[i] + above[i]) ? run.push(i) : close();
          close();
          pen.fill();
          pen.globalAlpha = 1;
        }
        // What uses no IMU is a range: its mean would say nothing more.
        const y = one.y || (look.kind === "baseline" ? null : one.mean);
        if (!y) continue;
        const values = numbers(y), at = one.y ? numbers(view.axes[panel.axis].x2) : x;
        pen.strokeStyle = colour;
        pen.lineWidth = look.kind === "truth" ? 0.8 : 1.3;
        pen.setLineDash(look.dash || []);
        pen.beginPath();
        let lifted = true;
        for (let i = 0; i < at.length; i++) {
          if (!Number.isFinite(at[i] + values[i])) { lifted = true; continue; }
          lifted ? pen.moveTo(px(at[i]), py(values[i])) : pen.lineTo(px(at[i]), py(values[i]));
          lifted = false;
        }
        pen.stroke();
        pen.setLineDash([]);
      }
    });
  };

  // ---- the explorer ----------------------------------------------------------------------------------------
  const explore = (root, data) => {
    const state = {view: data.views[0], zoom: null, off: new Set(data.off), groups: new Set(data.open)};
    const shown = key => !state.off.has(key);
    const bar = make("div", {className: "picks"}), groups = make("div", {className: "chips"});
    const legend = make("div", {className: "chips legend-of-series"}), box = make("div", {className: "panels"});
    const facts = make("ul", {className: "facts"});
    const about = make("details", {}, make("summary", {textContent: "About this ride"}), facts);
    root.replaceChildren(bar, groups, legend, box, about);
    const names = Object.keys(data.views[0].picks);

    const whole = view => {
      let low = Infinity, high = -Infinity;
      for (const axis of Object.values(view.axes)) {
        for (const x of numbers(axis.x)) { if (x < low) low = x; if (x > high) high = x; }
      }
      return [low, high > low ? high : low + 1];
    };
    const zoomTo = (from, to) => {
      const [low, high] = whole(state.view), least = 1e-3 * (high - low);
      state.zoom = [Math.max(from, low), Math.min(to, high)];
      if (state.zoom[1] - state.zoom[0] < least) state.zoom = [low, high];
      paint();
    };
    const button = (text, pressed, act, settings = {}) => {
      const one = make("button", {type: "button", textContent: text, ...settings});
      if (pressed !== null) one.setAttribute("aria-pressed", pressed);
      one.addEventListener("click", act);
      return one;
    };
    const pick = () => {
      bar.replaceChildren(...names.map((name, place) => {
        const fits = view => names.slice(0, place).every(other => view.picks[other] === state.view.picks[other]);
        const words = [...new Set(data.views.filter(fits).map(view => view.picks[name]))];
        const select = make("select", {disabled: words.length < 2}, ...words.map(word => make("option", {textContent: word, value: word})));
        select.value = state.view.picks[name];
        select.dataset.pick = name;
        select.addEventListener("change", () => {
          const wanted = {...state.view.picks, [name]: select.value};
          const score = view => names.reduce((sum, n, i) => sum + (view.picks[n] === wanted[n]) * (n === name ? 100 : names.length - i), 0);
          state.view = [...data.views].sort((a, b) => score(b) - score(a))[0];
          state.zoom = null;
          fill();
        });
        return make("label", {textContent: name + " "}, select);
      }), button("whole ride", null, () => zoomTo(...whole(state.view))), button("save as SVG", null, save));
    };
    const panelsOf = () => state.view.panels.filter(panel => state.groups.has(panel.group));
    const fill = () => {
      const view = state.view, all = [...new Set(view.panels.map(panel => panel.group))];
      if (!all.some(group => state.groups.has(group))) state.groups.add(all[0]);
      state.zoom = state.zoom || whole(view);
      pick();
      groups.replaceChildren(...all.map(group => button(group, state.groups.has(group), () => {
        state.groups.has(group) ? state.groups.delete(group) : state.groups.add(group);
        fill();
      })));
      const keys = new Set(panelsOf().flatMap(panel => panel.series.map(one => one.key)));
      legend.replaceChildren(...Object.keys(data.looks).filter(key => keys.has(key)).map(key => {
        const look = data.looks[key], swatch = make("i");
        swatch.style.borderTop = `3px ${look.dash ? "dashed" : "solid"} ${hue(look)}`;
        const one = button("", shown(key), () => {
          shown(key) ? state.off.add(key) : state.off.delete(key);
          one.setAttribute("aria-pressed", shown(key));
          paint();
        });
        one.dataset.series = key;
        one.append(swatch, look.label);
        return one;
      }));
      facts.replaceChildren(...view.facts.map(fact => make("li", {textContent: fact})));
      about.hidden = view.facts.length === 0;
      const panels = panelsOf();
      const tall = panels.length > 6 ? 78 : panels.length > 4 ? 96 : 120;
      box.replaceChildren(...panels.map((panel, i) => {
        const canvas = make("canvas", {height: tall});
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `${panel.title}, ${panel.unit}, over distance`);
        const head = make("div", {className: "head"}, make("b", {textContent: `${panel.title}, ${panel.unit}`}), make("output"));
        const one = make("div", {className: "panel"}, head, canvas, make("span", {className: "cursor", hidden: true}));
        one.panel = panel;
        one.tall = tall + (i === panels.length - 1 ? AXIS : 0);
        return one;
      }));
      paint();
    };
    const paint = () => {
      const all = [...box.children];
      all.forEach((one, i) => {
        const canvas = one.querySelector("canvas"), wide = box.clientWidth, dots = window.devicePixelRatio || 1;
        canvas.width = wide * dots;
        canvas.height = one.tall * dots;
        canvas.style.height = `${one.tall}px`;
        const pen = canvas.getContext("2d");
        pen.inside = insideOf(pen);
        pen.scale(dots, dots);
        pen.font = "11px system-ui, sans-serif";
        draw(pen, state.view, one.panel, data.looks, shown, state.zoom, wide, one.tall, i === 0, i === all.length - 1);
        [one.dataset.from, one.dataset.to] = state.zoom;
      });
    };
    const save = () => {
      const wide = 1080, parts = [];
      let down = 0;
      [...box.children].forEach((one, i, all) => {
        const pen = new SvgPen(`panel${i}`);
        draw(pen, state.view, one.panel, data.looks, shown, state.zoom, wide, one.tall, i === 0, i === all.length - 1);
        parts.push(`<g transform="translate(0 ${down + 16})"><text x="${LEFT}" y="-2" font-size="12" fill="${css("--ink")}">${one.panel.title}, ${one.panel.unit}</text>${pen.out.join("")}</g>`);
        down += one.tall + 16;
      });
      download("ride.svg", `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${wide} ${down}" font-family="sans-serif"><rect width="100%" height="100%" fill="${css("--page")}"/>${parts.join("")}</svg>`);
    };

    // ---- hover, drag, keys: for all panels at once ----------------------------------------------------------
    const placeAt = event => {
      const edge = box.getBoundingClientRect(), [from, to] = state.zoom;
      return from + (event.clientX - edge.left - LEFT) / (edge.width - LEFT - RIGHT) * (to - from);
    };
    const hover = place => {
      const [from, to] = state.zoom, wide = box.clientWidth;
      for (const one of box.children) {
        const x = numbers(state.view.axes[one.panel.axis].x);
        let i = -1, nearest = Infinity;
        for (let k = 0; k < x.length; k++) if (Math.abs(x[k] - place) < nearest) { nearest = Math.abs(x[k] - place); i = k; }
        const there = i >= 0 && place >= from && place <= to;
        const cursor = one.querySelector(".cursor"), output = one.querySelector("output");
        cursor.hidden = !there;
        cursor.style.left = `${LEFT + (place - from) / (to - from) * (wide - LEFT - RIGHT)}px`;
        const values = there ? one.panel.series.filter(s => shown(s.key) && (s.y || s.mean)).map(s => {
          const y = numbers(s.y || s.mean), value = s.y ? (y[2 * i] + y[2 * i + 1]) / 2 : y[i];
          const text = make("span", {textContent: `${data.looks[s.key].label} ${short(value)}`});
          text.style.color = hue(data.looks[s.key]);
          return text;
        }) : [];
        output.replaceChildren(...(there ? [`${place.toFixed(1)} ${state.view.along.split(", ").pop()}`] : []), ...values);
      }
    };
    let held = null;
    const mark = make("span", {className: "drag", hidden: true});
    root.append(mark);
    box.addEventListener("pointerdown", event => { held = {x: event.clientX, place: placeAt(event)}; });
    window.addEventListener("pointermove", event => {
      if (!box.contains(event.target) && held === null) return;
      hover(placeAt(event));
      mark.hidden = held === null || Math.abs(event.clientX - held.x) < 4;
      if (!mark.hidden) {
        const edge = root.getBoundingClientRect(), inner = box.getBoundingClientRect();
        mark.style.left = `${Math.min(event.clientX, held.x) - edge.left}px`;
        mark.style.width = `${Math.abs(event.clientX - held.x)}px`;
        mark.style.top = `${inner.top - edge.top}px`;
        mark.style.height = `${inner.height}px`;
      }
    });
    window.addEventListener("pointerup", event => {
      const began = held;
      held = null;
      mark.hidden = true;
      if (began && Math.abs(event.clientX - began.x) > 4) {
        const ends = [began.place, placeAt(event)].sort((a, b) => a - b);
        zoomTo(...ends);
      }
    });
    window.addEventListener("pointercancel", () => { held = null; mark.hidden = true; });
    box.addEventListener("pointerleave", () => { if (held === null) hover(NaN); });
    box.addEventListener("dblclick", () => zoomTo(...whole(state.view)));
    box.tabIndex = 0;
    box.setAttribute("aria-label", "Panels over distance: drag to zoom, arrows move, plus and minus zoom");
    box.addEventListener("keydown", event => {
      const [from, to] = state.zoom, step = 0.2 * (to - from), [low, high] = whole(state.view);
      const act = {
        ArrowLeft: [Math.max(low, from - step), Math.max(low, from - step) + to - from],
        ArrowRight: [Math.min(high, to + step) - to + from, Math.min(high, to + step)],
        "+": [from + step, to - step], "-": [from - step, to + step],
      }[event.key];
      if (act) { event.preventDefault(); zoomTo(...act); }
    });
    new ResizeObserver(paint).observe(box);
    dark.addEventListener("change", fill);
    fill();
  };

  const root = document.getElementById("rides-explorer"), store = document.getElementById("rides");
  if (root && store) explore(root, JSON.parse(store.textContent));

  // ---- drawings of the page as files: colours of the page become those of paper ---------------------------------
  for (const figure of document.querySelectorAll("figure[data-name]")) {
    const svg = figure.querySelector("svg");
    const one = make("button", {type: "button", className: "save", textContent: "save as SVG"});
    one.addEventListener("click", () => {
      const paper = {
        ink: "#1b2430", muted: "#667085", line: "#e4e7ec", axis: "#98a1af", page: "#ffffff",
        curve: "#eef1e6", transition: "#f6f8f2", tint: "#dbe9f4", good: "#15803d", bad: "#b42318",
      };
      const text = svg.outerHTML.replace(/light-dark\((#\w+), #\w+\)/g, "$1").replace(/var\(--([\w-]+)\)/g, (_, name) => paper[name] || css(`--${name}`));
      download(`${figure.dataset.name}.svg`, text);
    });
    (figure.querySelector("figcaption") || figure).append(one);
  }
  // ---- text that is there to be copied ------------------------------------------------------------------------
  for (const text of document.querySelectorAll("pre[data-copy]")) {
    const one = make("button", {type: "button", className: "save", textContent: "copy"});
    one.addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(text.textContent);
        one.textContent = "copied";
      } catch {
        // A page from a file may not write to the clipboard: what is to be copied is selected.
        getSelection().selectAllChildren(text);
        one.textContent = document.execCommand("copy") ? "copied" : "selected: press Ctrl+C";
      }
    });
    text.before(one);
  }
  // A link into a folded part opens it.
  const open = () => {
    const wanted = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let part = wanted; part; part = part.parentElement) if (part.tagName === "DETAILS") part.open = true;
    if (wanted) wanted.scrollIntoView();
  };
  window.addEventListener("hashchange", open);
  open();
})();
