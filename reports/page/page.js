"use strict";

// What can be tried out on the page: the chart, the pictures to compare and the curves over time. All text from the run
// is set as text, never as HTML.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const id = (name) => document.getElementById(name);
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const redraw = []; // what depends on the colours of the page

  function element(kind, text, parent) {
    const made = document.createElement(kind);
    if (text !== undefined) made.textContent = text;
    if (parent) parent.append(made);
    return made;
  }

  function options(select, labels) {
    select.replaceChildren();
    labels.forEach((label, n) => (element("option", label, select).value = n));
  }

  // Plotly reads a few tags in its texts.
  const plain = (text) => String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");

  function layout(more) {
    const line = style("--line"), text = style("--text");
    const axis = { gridcolor: line, zerolinecolor: line, linecolor: line, automargin: true };
    const made = {
      paper_bgcolor: style("--back"), plot_bgcolor: style("--back"), hovermode: "closest",
      font: { color: text, family: getComputedStyle(document.body).fontFamily, size: 12 },
      margin: { l: 60, r: 16, t: 16, b: 48 }, ...more,
    };
    for (const key of Object.keys(made)) if (/^[xy]axis/.test(key)) made[key] = { ...axis, ...made[key] };
    return made;
  }

  const config = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["lasso2d", "select2d", "toImage"] };

  // --- Speed against accuracy ---

  const MANY = 400; // points, of which intervals and lines hide more than they show
  const SYMBOLS = ["circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x", "star", "pentagon", "hexagon",
                   "triangle-left", "triangle-right", "hourglass", "bowtie"];

  function speedAgainstAccuracy({ charts, told: kinds, words, colours, visible }) {
    const plot = id("chart-plot"), choose = id("chart-place");
    let chart = charts[0];
    if (chart.points.length > MANY) id("chart-bars").checked = id("chart-curves").checked = false;
    options(choose, charts.map((one) => one.label));

    function traces(zero) {
      const at = (point) => point.error || zero;
      const made = [];
      if (id("chart-curves").checked)
        for (const curve of chart.curves) {
          const mine = curve.map((n) => chart.points[n]), { variant } = mine[0];
          made.push({
            x: mine.map(at), y: mine.map((point) => point.time[0]), mode: "lines", hoverinfo: "skip", showlegend: false,
            legendgroup: variant, line: { color: colours[variant], width: 1 }, opacity: 0.5,
          });
        }
      for (const variant of new Set(chart.points.map((point) => point.variant))) {
        const places = chart.points.map((_, n) => n).filter((n) => chart.points[n].variant === variant);
        const mine = places.map((n) => chart.points[n]);
        made.push({ x: [null], y: [null], mode: "markers", name: plain(variant), legendgroup: variant,
                    marker: { color: colours[variant], size: 10 } });
        const [time, low, high] = [0, 1, 2].map((k) => mine.map((point) => point.time[k]));
        made.push({
          x: mine.map(at), y: time, mode: "markers", showlegend: false, legendgroup: variant, customdata: places,
          text: mine.map((point) => `${plain(point.name)}<br>error ${plain(point.told[0])}`),
          hovertemplate: "%{text}, %{y:.4g} s<extra></extra>",
          marker: {
            color: colours[variant], size: 10, symbol: mine.map((point) => SYMBOLS[point.family % SYMBOLS.length]),
            opacity: mine.map((point) => 0.35 + 0.65 * point.share), line: { color: style("--text"), width: 0.5 },
          },
          error_y: {
            type: "data", symmetric: false, visible: id("chart-bars").checked, thickness: 1.2, width: 3,
            color: colours[variant], array: high.map((end, n) => (end === null ? 0 : end - time[n])),
            arrayminus: low.map((end, n) => (end === null ? 0 : time[n] - end)),
          },
        });
      }
      const front = chart.front.map((n) => chart.points[n]).reverse();
      if (front.length)
        made.push({
          x: front.map(at), y: front.map((point) => point.time[0]), mode: "lines", name: "front", hoverinfo: "skip",
          line: { color: style("--soft"), width: 1.2, shape: "hv" },
        });
      return made;
    }

    function draw() {
      const errors = chart.points.map((point) => point.error).filter((error) => error > 0);
      const least = Math.min(visible, ...errors), none = errors.length < chart.points.length;
      const zero = least / 8, left = none ? zero / 2 : least / 1.6;
      const right = 1.6 * Math.max(visible, ...errors);
      const upright = (x, color, dash) => ({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line: { color, width: 1, dash } });
      const shapes = [upright(visible, style("--text"), "dot")];
      if (chart.resolution > left)
        shapes.push({ type: "rect", x0: left / 10, x1: chart.resolution, yref: "paper", y0: 0, y1: 1, line: { width: 0 },
                      fillcolor: style("--soft"), opacity: 0.18, layer: "below" });
      const annotations = [{ x: Math.log10(visible), y: 1, yref: "paper", text: "1/255 ", showarrow: false, xanchor: "right", yanchor: "top" }];
      if (none) annotations.push({ x: Math.log10(zero), y: 0, yref: "paper", text: chart.sampled ? "no error that the truth can tell" : "error exactly 0", showarrow: false, yanchor: "bottom", textangle: -90 });
      const narrow = plot.clientWidth < 600;
      Plotly.react(plot, traces(zero), layout({
        xaxis: { type: "log", range: [Math.log10(left), Math.log10(right)], title: { text: plain(chart.axis) }, exponentformat: "power" },
        yaxis: { type: "log", title: { text: "steady frame (s)" }, exponentformat: "power" },
        legend: narrow ? { orientation: "h", y: -0.2 } : { orientation: "h", y: 1.02, yanchor: "bottom" },
        shapes, annotations, height: plot.clientHeight || 540,
      }), config);
    }

    function show(n) {
      const point = chart.points[n], picture = id("point-picture");
      picture.hidden = !point.picture;
      picture.src = point.picture ? data.images[point.picture] : "";
      picture.alt = point.picture ? `Picture of ${point.name}` : "";
      id("point-none").textContent = point.picture ? "" : "its picture is not inside this page";
      id("point-name").textContent = point.number ? `${point.number}. ${point.name}` : point.name;
      id("point-where").textContent = point.number ? `${point.where}; number ${point.number} of the front` : point.where;
      const told = id("point-told");
      told.replaceChildren();
      kinds.forEach((what, k) => {
        element("dt", what, told);
        element("dd", point.told[k], told);
      });
      id("point-commands").replaceChildren(element("p", "Click the point for the command that makes it again."));
    }

    function commands(n) {
      show(n);
      const box = id("point-commands");
      box.replaceChildren();
      for (const [what, key] of [["Render it again", "render"], ["Measure it again", "again"]]) {
        const line = chart.points[n][key].map((place) => words[place]).join(" ");
        const one = element("div", undefined, box);
        one.className = "command";
        element("span", `${what} `, one);
        if (!line.startsWith("unavailable")) {
          const copy = element("button", "copy", one);
          copy.type = "button";
          copy.addEventListener("click", () => copied(copy, line));
        }
        element("code", line, one);
      }
    }

    async function copied(button, line) {
      try {
        await navigator.clipboard.writeText(line);
        button.textContent = "copied";
      } catch {
        button.textContent = "select it below"; // a page opened from a file may not write the clipboard
      }
    }

    function list() {
      const box = id("chart-list").querySelector("ol");
      box.replaceChildren();
      const order = chart.points.map((_, n) => n).sort((a, b) => chart.points[a].time[0] - chart.points[b].time[0]);
      for (const n of order) {
        const point = chart.points[n], button = element("button", `${point.name}: ${point.told[2]}, error ${point.told[0]}`);
        button.type = "button";
        button.addEventListener("focus", () => show(n));
        button.addEventListener("click", () => commands(n));
        element("li", undefined, box).append(button);
      }
    }

    let listed = null;
    const listIfOpen = () => {
      if (id("chart-list").open && listed !== chart) list(), (listed = chart);
    };
    id("chart-list").addEventListener("toggle", listIfOpen);
    choose.addEventListener("change", () => {
      chart = charts[choose.value];
      draw();
      listIfOpen();
    });
    for (const box of ["chart-curves", "chart-bars"]) id(box).addEventListener("change", draw);
    draw();
    plot.on("plotly_hover", ({ points }) => show(points[0].customdata));
    plot.on("plotly_click", ({ points }) => commands(points[0].customdata));
    redraw.push(draw);
  }

  // --- Pictures side by side ---

  const MAPS = { "error-a": ["a", "error"], "error-b": ["b", "error"], "flip-a": ["a", "flip"], "flip-b": ["b", "flip"] };
  const LENS = 11; // pixels that the magnifier shows across

  function comparer({ places }) {
    const canvas = id("compare-canvas"), pen = canvas.getContext("2d", { willReadFrequently: true });
    const mode = id("compare-mode"), loaded = new Map();
    let pictures = [], at = null, turn = 0, timer = null;
    options(id("compare-place"), places.map((place) => place.label));

    function image(key) {
      if (!loaded.has(key))
        loaded.set(key, new Promise((done) => {
          const made = new Image();
          made.onload = () => done(made);
          made.src = data.images[key];
        }));
      return loaded.get(key);
    }

    const chosen = (which) => pictures[id(`compare-${which}`).value];

    function pixels(picture, width, height) {
      const paper = new OffscreenCanvas(width, height).getContext("2d");
      paper.drawImage(picture, 0, 0, width, height);
      return paper.getImageData(0, 0, width, height);
    }

    function difference(a, b, width, height) {
      const found = pixels(a, width, height), other = pixels(b, width, height).data, times = 2 ** id("compare-times").value;
      for (let n = 0; n < other.length; n++) if (n % 4 !== 3) found.data[n] = times * Math.abs(found.data[n] - other[n]);
      pen.putImageData(found, 0, 0);
    }

    async function draw() {
      const [one, two] = [chosen("a"), chosen("b")], kind = mode.value;
      const [a, b] = await Promise.all([image(one.picture), image(two.picture)]);
      if (one !== chosen("a") || two !== chosen("b") || kind !== mode.value) return;
      const [width, height] = one.size;
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      canvas.style.width = `${Math.max(width, Math.min(512, Math.floor(512 / width) * width))}px`;
      const told = [`A, ${one.label}: ${one.told.join("; ")}.`, `B, ${two.label}: ${two.told.join("; ")}.`];
      pen.clearRect(0, 0, width, height);
      if (kind === "swipe") {
        const split = Math.round((width * id("compare-at").value) / 100);
        pen.drawImage(b, 0, 0, width, height);
        if (split) pen.drawImage(a, 0, 0, (a.width * split) / width, a.height, 0, 0, split, height);
        pen.fillStyle = "#ffffff";
        pen.fillRect(split - 0.5, 0, 1, height);
      } else if (kind === "flicker") {
        pen.drawImage(turn ? b : a, 0, 0, width, height);
      } else if (kind === "difference") {
        difference(a, b, width, height);
      } else {
        const [which, map] = MAPS[kind], key = chosen(which)[map];
        if (key) pen.drawImage(await image(key), 0, 0, width, height);
        else {
          pen.fillStyle = "#eeeeee";
          pen.fillRect(0, 0, width, height);
          if (chosen(which).truth) told.push(`${which.toUpperCase()} is the truth, which has no error.`);
          else told.push(`The ${map === "flip" ? "FLIP" : "error"} map of ${which.toUpperCase()} is unavailable: not stored, or too large for this page.`);
        }
      }
      id("compare-told").textContent = told.join(" ");
      magnify();
    }

    async function magnify() {
      if (!at) return;
      const width = canvas.width, height = canvas.height;
      const x = Math.min(width - 1, Math.max(0, at[0])), y = Math.min(height - 1, Math.max(0, at[1]));
      const values = [];
      for (const which of ["a", "b"]) {
        const picture = await image(chosen(which).picture), glass = id(`compare-lens-${which}`).getContext("2d");
        const scale = picture.width / width, side = glass.canvas.width;
        glass.imageSmoothingEnabled = false;
        glass.clearRect(0, 0, side, side);
        const half = (LENS - 1) / 2;
        glass.drawImage(picture, (x - half) * scale, (y - half) * scale, LENS * scale, LENS * scale, 0, 0, side, side);
        const box = side / LENS;
        glass.strokeStyle = "#ff00ff";
        glass.strokeRect(half * box, half * box, box, box);
        const [r, g, b] = glass.getImageData((half + 0.5) * box, (half + 0.5) * box, 1, 1).data;
        values.push(`${which.toUpperCase()} (${r}, ${g}, ${b})`);
      }
      id("compare-lens-told").textContent = `pixel ${x}, ${y}: ${values.join(", ")}`;
    }

    function choosePlace() {
      ({ pictures } = places[id("compare-place").value]);
      for (const which of ["a", "b"]) options(id(`compare-${which}`), pictures.map((picture) => picture.label));
      id("compare-b").value = pictures.length - 1; // the truth
      draw();
    }

    function chooseMode() {
      clearInterval(timer);
      if (mode.value === "flicker") timer = setInterval(() => ((turn = 1 - turn), draw()), 600);
      id("compare-swipe").hidden = mode.value !== "swipe";
      id("compare-gain").hidden = mode.value !== "difference";
      draw();
    }

    function factor() {
      id("compare-factor").textContent = `${2 ** id("compare-times").value}`;
      draw();
    }

    canvas.addEventListener("pointermove", (event) => {
      const box = canvas.getBoundingClientRect();
      const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
      at = [Math.floor(x * canvas.width), Math.floor(y * canvas.height)];
      if (mode.value === "swipe" && event.buttons) id("compare-at").value = 100 * x;
      if (mode.value === "swipe" && event.buttons) draw();
      else magnify();
    });
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    id("compare-stage").addEventListener("keydown", (event) => {
      if (!(event.key in steps)) return;
      event.preventDefault();
      at = (at ?? [canvas.width >> 1, canvas.height >> 1]).map((place, n) => place + steps[event.key][n]);
      magnify();
    });
    id("compare-place").addEventListener("change", choosePlace);
    for (const which of ["a", "b"]) id(`compare-${which}`).addEventListener("change", draw);
    mode.addEventListener("change", chooseMode);
    id("compare-at").addEventListener("input", draw);
    id("compare-times").addEventListener("input", factor);
    choosePlace();
    factor();
  }

  // --- Over time ---

  function overTime({ places, phases, kinds, step }) {
    const plot = id("series-plot"), place = id("series-place"), kind = id("series-kind"), shared = id("series-shared");
    options(place, places.map((one) => one.label));
    options(kind, kinds);
    const told = id("series-phases");
    told.textContent = "Behind the curves, the phases that the renderer marked:";
    for (const [name, colour] of Object.entries(phases)) {
      const box = element("span", undefined, told);
      box.className = "phase";
      box.style.background = colour;
      told.append(name);
    }
    element("span", " Shown is the first good process of each, which finds its caches cold.", told);

    function draw() {
      const { processes } = places[place.value], what = kinds[kind.value], high = step * processes.length + 60;
      const traces = [], shapes = [], annotations = [], axes = {};
      const longest = Math.max(...processes.map((one) => one.wall));
      processes.forEach((one, n) => {
        const suffix = n ? n + 1 : "", [t, y] = one.curves[what] ?? [[], []];
        const top = 1 - n / processes.length, bottom = 1 - (n + 0.62) / processes.length;
        traces.push({ x: t, y, xaxis: `x${suffix}`, yaxis: `y${suffix}`, mode: "lines+markers", marker: { size: 3 },
                      line: { color: style("--text"), width: 1.5 }, showlegend: false,
                      hovertemplate: `%{x:.4g} s: %{y:.4g}<extra>${plain(one.label)}</extra>` });
        axes[`xaxis${suffix}`] = { domain: [0, 1], anchor: `y${suffix}`, range: [0, shared.checked ? longest : one.wall], ticksuffix: " s" };
        axes[`yaxis${suffix}`] = { domain: [bottom, top], anchor: `x${suffix}`, rangemode: "tozero", nticks: 4 };
        for (const [name, start, end] of one.phases)
          shapes.push({ type: "rect", xref: `x${suffix}`, yref: `y${suffix} domain`, x0: start, x1: end, y0: 0, y1: 1,
                        line: { width: 0 }, fillcolor: phases[name], opacity: 0.45, layer: "below" });
        const note = t.length ? "" : ": too few samples, or none";
        annotations.push({ xref: "paper", x: 0, xanchor: "left", yref: "paper", y: top, yanchor: "bottom", showarrow: false,
                           text: `<b>${plain(one.label)}</b>, ${one.wall.toPrecision(3)} s${note}` });
      });
      plot.style.minHeight = `${high + 2}px`;
      Plotly.react(plot, traces, layout({ ...axes, shapes, annotations, height: high,
                                          margin: { l: 56, r: 16, t: 26, b: 34 } }), config);
    }

    for (const one of [place, kind, shared]) one.addEventListener("change", draw);
    draw();
    redraw.push(draw);
  }

  // --- Against what a run varies ---

  const DASHES = ["solid", "dash", "dot", "dashdot"];

  function sweeps({ panels, quantities, colours }) {
    const plot = id("sweep-plot"), place = id("sweep-place"), kind = id("sweep-kind"), log = id("sweep-log"), bands = id("sweep-bands");
    options(place, panels.map((one) => one.label));
    options(kind, quantities.map((one) => one.title));
    const follow = () => (log.checked = quantities[kind.value].log);

    function draw() {
      const panel = panels[place.value], { title, unit } = quantities[kind.value];
      const lines = panel.lines.map((line) => ({ ...line, points: line.points[kind.value] })).filter((line) => line.points.length);
      const traces = [], seen = new Map();
      for (const { name, variant, look, points } of lines) {
        const at = (k) => points.map((point) => (point[k] === null ? null : point[k] / unit)), x = points.map((point) => point[0]);
        const nth = seen.get(variant) ?? 0, colour = colours[variant], sure = points.filter((point) => point[2] !== null);
        seen.set(variant, nth + 1);
        if (bands.checked && sure.length > 1) {
          const back = [...sure].reverse();
          traces.push({ x: [...sure, ...back].map((point) => point[0]), fill: "toself", mode: "lines", hoverinfo: "skip",
                        y: [...sure.map((point) => point[3] / unit), ...back.map((point) => point[2] / unit)],
                        fillcolor: `${colour}33`, line: { width: 0 }, showlegend: false, legendgroup: name });
        }
        const [low, high] = [at(2), at(3)];
        traces.push({
          x, y: at(1), mode: "lines+markers", name: plain(name), legendgroup: name, line: { color: colour, width: 2, dash: DASHES[nth % DASHES.length] },
          marker: { color: colour, size: 7, symbol: SYMBOLS[look % SYMBOLS.length] },
          text: low.map((end, n) => (end === null ? "" : ` [${end.toPrecision(3)}, ${high[n].toPrecision(3)}]`)),
          hovertemplate: `${plain(name)}: %{y:.4g}%{text}<extra></extra>`,
        });
      }
      const crossings = panel.crossings[kind.value];
      if (crossings.length)
        traces.push({ x: crossings.map(([x]) => x), y: crossings.map(([, y]) => y / unit), mode: "markers", showlegend: false,
                      text: crossings.map(([, , words]) => plain(words)), hovertemplate: "%{text}<extra></extra>",
                      marker: { symbol: "circle-open", size: 15, color: style("--text"), line: { width: 1.5 } } });
      id("sweep-told").textContent = crossings.map(([, , words]) => words).join(" ");
      const few = panel.ticks.length < 12 ? { tickvals: panel.ticks.map(([x]) => x), ticktext: panel.ticks.map(([, text]) => plain(text)) } : {};
      const mark = panel.mark ? [{ text: plain(panel.mark), xref: "paper", yref: "paper", x: 0.5, y: 0.5, showarrow: false, textangle: -15,
                                   font: { size: 28, color: "#b00020" }, opacity: 0.6 }] : [];
      Plotly.react(plot, traces, layout({
        xaxis: { type: panel.log ? "log" : "linear", title: { text: plain(panel.axis) }, ...few },
        yaxis: { type: log.checked ? "log" : "linear", title: { text: plain(title) }, exponentformat: "power", rangemode: "tozero" },
        legend: plot.clientWidth < 600 ? { orientation: "h", y: -0.2 } : { orientation: "h", y: 1.02, yanchor: "bottom" },
        hovermode: "x unified", annotations: mark, height: plot.clientHeight || 540,
      }), config);
    }

    kind.addEventListener("change", () => (follow(), draw()));
    for (const one of [place, bands, log]) one.addEventListener("change", draw);
    follow();
    draw();
    redraw.push(draw);
  }

  // --- The page ---

  function theme() {
    const button = id("theme"), root = document.documentElement;
    const dark = () => (root.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";
    const told = () => {
      button.textContent = dark() ? "Light" : "Dark";
      button.setAttribute("aria-pressed", dark());
      redraw.forEach((draw) => draw());
    };
    button.addEventListener("click", () => ((root.dataset.theme = dark() ? "light" : "dark"), told()));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", told);
    button.textContent = dark() ? "Light" : "Dark";
  }

  // A link into a closed section opens it.
  function reveal(name) {
    const place = name && id(decodeURIComponent(name));
    if (!place) return;
    for (let box = place.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
    place.scrollIntoView();
  }
  window.addEventListener("hashchange", () => reveal(location.hash.slice(1)));
  document.addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#"]');
    if (link) setTimeout(() => reveal(link.hash.slice(1)), 0); // also when the address has it already
  });
  reveal(location.hash.slice(1));
  id("every")?.addEventListener("click", (event) => {
    document.querySelector(".bars").classList.add("all");
    event.target.remove();
  });

  window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((one) => (one.open = true)));
  theme();

  // What can be tried out starts when its section is first open: it needs its size, and the library seconds to load.
  const parts = { "chart": ["pareto_figure", speedAgainstAccuracy], "comparer": ["pictures_figure", comparer], "series": ["cpu_figure", overTime], "sweep": ["sweep_figure", sweeps] };
  for (const [name, [key, start]] of Object.entries(parts)) {
    if (!data[key]) continue;
    const section = id(name).closest("details");
    const begin = () => {
      if (!section.open) return;
      section.removeEventListener("toggle", begin);
      if (key !== "pictures_figure" && !window.Plotly) element("script", id("drawing").textContent, document.body);
      start(data[key]);
    };
    section.addEventListener("toggle", begin);
    begin();
  }
})();
