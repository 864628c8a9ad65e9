// Figures of a report. The page holds the numbers as base64 (`data`); everything is drawn from them by
// BokehJS. Texts of archives are put in as text, never as HTML. `explorer.js` uses what this defines.
"use strict"
const report = (() => {
  const data = JSON.parse(document.getElementById("data").textContent)
  const MOST_LINES = 8 // of one chart
  const MOST_POINTS = 20000 // of one scatter chart
  const MOST_NAMES = 60 // beside a chart
  const MOST_CELLS = 150 // along a side of a map
  const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8a6d3b"]
  const VIRIDIS = ["#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6dcd59", "#b4de2c", "#fde725"]
  const coarse = matchMedia("(pointer: coarse)").matches

  // ---- numbers ----------------------------------------------------------------------------------

  function decoded(text, type) {
    const raw = atob(text)
    const bytes = new Uint8Array(raw.length)
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i)
    if (type === "u1") return bytes
    return new { f4: Float32Array, f8: Float64Array, i4: Int32Array }[type](bytes.buffer)
  }

  const columns = new Map(Object.entries(data.columns))
  for (const column of columns.values()) column.values = column.words ?? decoded(column.values, "f8")
  const axes = new Map(Object.entries(data.axes))
  const quantities = new Map(Object.entries(data.quantities))
  for (const [name, q] of quantities) {
    q.name = name
    q.data = decoded(q.data, q.type)
    q.strides = q.shape.map((_, i) => q.shape.slice(i + 1).reduce((a, b) => a * b, 1))
    for (const dim in q.at) q.at[dim] = Array.from(decoded(q.at[dim], "i4"))
    // A curve may have fewer values of an axis than the axis has: the nearest one stands for each.
    q.nearest = q.dims.map((dim) => (dim in q.at ? nearestOf(q.at[dim], axes.get(dim).count) : null))
  }

  function nearestOf(places, count) {
    const found = new Int32Array(count)
    let j = 0
    for (let i = 0; i < count; i++) {
      while (j + 1 < places.length && Math.abs(places[j + 1] - i) <= Math.abs(places[j] - i)) j++
      found[i] = j
    }
    return found
  }

  function valueOf(q, at) {
    let index = 0
    for (let i = 0; i < q.dims.length; i++) {
      const place = at[q.dims[i]] ?? 0
      index += (q.nearest[i] ? q.nearest[i][place] : place) * q.strides[i]
    }
    return q.data[index]
  }

  // Places along an axis at which a quantity has values of its own.
  function placesOf(q, dim) {
    return q.at[dim] ?? Array.from({ length: axes.get(dim).count }, (_, i) => i)
  }

  function spread(places, most) {
    if (places.length <= most) return places
    const found = []
    for (let i = 0; i < most; i++) found.push(places[Math.round((i * (places.length - 1)) / (most - 1))])
    return found
  }

  function numberText(value) {
    if (value === null || Number.isNaN(value)) return "no value"
    if (!Number.isFinite(value)) return value > 0 ? "infinite" : "-infinite"
    const size = Math.abs(value)
    if (value === 0 || (size >= 1e-3 && size < 1e7)) return String(Number(value.toPrecision(size >= 1e4 ? 6 : 5)))
    return value.toExponential(3)
  }

  function withUnit(text, unit) {
    return unit ? `${text} ${unit}` : text
  }

  function textAt(key, place) {
    const column = columns.get(key)
    if (column.words) return column.words[place]
    return withUnit(numberText(column.values[place]), column.unit)
  }

  // What a place along an axis is called: the name of a design, or a number with its unit.
  function nameAt(dim, place) {
    const key = axes.get(dim).named_by ?? dim
    return textAt(key, place)
  }

  function heading(item, name) {
    return item.unit ? `${name} [${item.unit}]` : name
  }

  // ---- the page ---------------------------------------------------------------------------------

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag)
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value)
    made.append(...children)
    return made
  }

  // BokehJS would set mathematics between these signs, and fetch a library for it.
  function plain(text) {
    return String(text).replace(/\$\$/g, "$\u200b$").replace(/\\([[(\])])/g, "\\\u200b$1")
  }

  function short(text, most) {
    return text.length > most ? text.slice(0, most - 1) + "…" : text
  }

  function isLogarithmic(values) {
    const found = Array.from(values)
    if (found.length < 4 || !(Math.min(...found.slice(0, 5000)) > 0)) return false
    if (found[found.length - 1] / found[0] < 8) return false
    const even = found[1] / found[0]
    return found.every((v, i) => i === 0 || Math.abs(v / found[i - 1] / even - 1) < 0.02)
  }

  // A plot with zoom, hover and a legend of buttons below it; `card` is its place in the page.
  function plot(card, { x, y, xKey, yKey, xLog = false, yLog = false, height = 330, lines = true }) {
    const Bokeh = window.Bokeh
    const tools = [
      new Bokeh.PanTool(), new Bokeh.BoxZoomTool(), new Bokeh.WheelZoomTool(), new Bokeh.ResetTool(),
      new Bokeh.SaveTool(),
    ]
    const options = {
      sizing_mode: "stretch_width", height, tools, toolbar_location: "above", x_axis_label: plain(x),
      y_axis_label: plain(y), x_axis_type: xLog ? "log" : "linear", y_axis_type: yLog ? "log" : "linear",
      output_backend: "canvas", min_border_right: 12,
    }
    const figure = new Bokeh.Plotting.Figure(options)
    figure.toolbar.logo = null
    // A finger scrolls the page; who wants to zoom chooses a tool first.
    figure.toolbar.active_drag = coarse ? null : tools[1]
    figure.toolbar.active_scroll = null
    for (const axis of [figure.xaxis, figure.yaxis]) {
      axis.axis_label_text_font_style = "normal"
      axis.axis_label_text_color = "#333"
    }
    figure.outline_line_color = "#bbb"
    figure.xgrid.grid_line_color = figure.ygrid.grid_line_color = "#e5e5e5"
    if (xLog) figure.xaxis.ticker = new Bokeh.LogTicker({ mantissas: [1, 2, 3, 5] })
    if (yLog) figure.yaxis.ticker = new Bokeh.LogTicker({ mantissas: [1, 2, 3, 5] })
    words(figure.xaxis, figure.xgrid, xKey)
    words(figure.yaxis, figure.ygrid, yKey)
    const place = element("div", { class: "plot" })
    const legend = element("div", { class: "legend" })
    card.append(place, legend)
    return {
      figure,
      legend,
      // Tooltips: fixed values of axes as text, varying ones out of the source.
      hover(renderers, tooltips, mode = "mouse") {
        const tool = new Bokeh.HoverTool({ renderers, tooltips, mode, visible: false })
        figure.add_tools(tool)
        return tool
      },
      entry(text, colour, renderers, visible = true) {
        const button = element("button", { type: "button", "aria-pressed": String(visible) })
        const swatch = element("span", { class: "swatch" })
        swatch.style.background = colour
        button.append(swatch, text)
        const set = (on) => {
          button.setAttribute("aria-pressed", String(on))
          for (const renderer of renderers) renderer.visible = on
        }
        if (!visible) set(false)
        button.addEventListener("click", () => set(button.getAttribute("aria-pressed") !== "true"))
        legend.append(button)
        return button
      },
      show() {
        const shown = Bokeh.Plotting.show(figure, place)
        place.forget = () => shown.then((view) => view.remove())
      },
    }
  }

  // Names instead of numbers along an axis of words.
  function words(axis, grid, key) {
    const column = columns.get(key)
    if (!column?.words) return
    const places = spread(column.words.map((_, i) => i), 40)
    axis.ticker = grid.ticker = new window.Bokeh.FixedTicker({ ticks: places, minor_ticks: [] })
    axis.major_label_overrides = new Map(places.map((i) => [i, plain(short(column.words[i], 26))]))
  }

  function coordinate(key, place) {
    const column = columns.get(key)
    return column.words ? place : column.values[place]
  }

  // An axis and its columns of designs; designs with names need no number.
  function keysOf(dim) {
    const axis = axes.get(dim)
    const own = axis.list && axis.named_by ? [] : [dim]
    return [...new Set([...(axis.named_by ? [axis.named_by] : []), ...own, ...axis.columns])].slice(0, 12)
  }

  // Tooltips of all axes: constant ones as text, those in `varying` out of the source's columns.
  function tooltipsOf(dims, at, varying, first) {
    const found = [...first]
    const sorted = [...dims.filter((d) => varying.has(d)), ...dims.filter((d) => !varying.has(d))]
    for (const dim of sorted) {
      for (const key of keysOf(dim)) {
        const column = columns.get(key)
        if (varying.has(dim)) {
          const name = `k${[...columns.keys()].indexOf(key)}`
          found.push([key, column.words ? `@{${name}}` : `@{${name}}{%.5g} ${escapePlaceholders(column.unit)}`])
        } else {
          found.push([key, escapePlaceholders(textAt(key, at[dim] ?? 0))])
        }
      }
    }
    return found
  }

  // In tooltips, BokehJS replaces what follows these signs.
  function escapePlaceholders(text) {
    return String(text).replace(/[@$]/g, (sign) => (sign === "@" ? "＠" : "＄"))
  }

  // Columns of a source that hold the axes' values at some places along one dimension.
  function columnsAlong(dim, places) {
    const found = {}
    for (const key of keysOf(dim)) {
      const column = columns.get(key)
      found[`k${[...columns.keys()].indexOf(key)}`] = places.map((place) => column.values[place])
    }
    return found
  }

  function statusAt(at) {
    const q = quantities.get("status")
    return q ? data.outcomes[valueOf(q, at)] ?? "" : ""
  }

  const viridis = Array.from({ length: 256 }, (_, i) => ramp(i / 255))

  function ramp(position) {
    const x = Math.min(Math.max(position, 0), 1) * (VIRIDIS.length - 1)
    const i = Math.min(Math.floor(x), VIRIDIS.length - 2)
    const part = (hex, j) => parseInt(hex.slice(1 + 2 * j, 3 + 2 * j), 16)
    const mixed = [0, 1, 2].map((j) => Math.round(part(VIRIDIS[i], j) + (x - i) * (part(VIRIDIS[i + 1], j) - part(VIRIDIS[i], j))))
    return "#" + mixed.map((v) => v.toString(16).padStart(2, "0")).join("")
  }

  function colourOf(i, count) {
    return ramp(count > 1 ? (0.85 * i) / (count - 1) : 0.3)
  }

  // ---- kinds of figures -------------------------------------------------------------------------
  // Each draws into a card and returns a function that draws again at other places of the axes.

  // Single numbers over an axis or over a column of designs; a line for each value of another axis.
  function drawNumbers(card, spec, at) {
    const list = spec.quantities.map((name) => quantities.get(name))
    const key = spec.x
    const along = columns.get(key)
    const dim = along.dim
    const places = spread(placesOf(list[0], dim), MOST_POINTS)
    const over = spec.lines ? spread(placesOf(list[0], spec.lines), MOST_LINES) : [null]
    const points = axes.get(dim).list || Boolean(along.words)
    const xLog = !along.words && !axes.get(dim).list && isLogarithmic(along.values)
    const upright = Boolean(along.words) // names are legible beside a chart, not below it
    const label = list.length === 1 ? heading(list[0], spec.quantities[0]) : heading(list[0], spec.kind === "numbers" ? spec.quantities[0] : "")
    const name = heading(along, axes.get(dim).list && key === dim ? "design" : key)
    const chart = plot(card, upright
      ? { x: label, y: "", yKey: key, height: Math.min(1200, 150 + 19 * Math.min(places.length, 60)) }
      : { x: name, y: label, xKey: key, xLog })
    if (upright) chart.figure.y_range = new window.Bokeh.Range1d({ start: places.length - 0.5, end: -0.5 })
    const series = []
    for (const [i, q] of list.entries()) {
      for (const [j, place] of over.entries()) {
        const source = new window.Bokeh.ColumnDataSource({ data: {} })
        const count = list.length * over.length
        const colour = over.length > 1 ? colourOf(j, over.length) : COLOURS[i % COLOURS.length]
        const [x, y] = upright ? ["v", "c"] : ["c", "v"]
        const renderers = []
        if (!points) renderers.push(chart.figure.line({ field: x }, { field: y }, { source, line_color: colour, line_width: 2 }))
        const size = points && places.length > 500 ? 4 : points ? 9 : 5
        if (points || places.length <= 80) {
          renderers.push(chart.figure.scatter({ field: x }, { field: y }, {
            source, fill_color: i > 0 && points ? null : colour, line_color: colour, fill_alpha: 0.85,
            size: i > 0 && points ? size + 5 : size, marker: i > 0 && points ? "diamond" : "circle",
            line_width: i > 0 && points ? 2 : 1,
          }))
        }
        const hover = chart.hover(renderers.slice(-1), [])
        if (count > 1) {
          const text = [list.length > 1 ? spec.quantities[i] : "", place === null ? "" : nameAt(spec.lines, place)]
          chart.entry(text.filter(Boolean).join(", "), colour, renderers)
        }
        series.push({ q, place, source, hover, name: spec.quantities[i] })
      }
    }
    if (over.length > 1) card.append(element("p", { class: "note" }, `A line for each value of ${spec.lines}` + (over.length < axes.get(spec.lines).count ? `, ${over.length} of ${axes.get(spec.lines).count}.` : ".")))
    if (places.length < axes.get(dim).count) card.append(element("p", { class: "note" }, `${places.length} of ${axes.get(dim).count} points are drawn.`))
    const update = (now) => {
      for (const { q, place, source, hover, name: own } of series) {
        const here = { ...now }
        if (place !== null) here[spec.lines] = place
        const values = places.map((p) => ((here[dim] = p), valueOf(q, here)))
        source.data = {
          c: places.map((p) => coordinate(key, p)), v: values.map((v) => (Number.isFinite(v) ? v : NaN)),
          ...columnsAlong(dim, places),
        }
        const value = [own, `@{v}{%.5g} ${escapePlaceholders(q.unit)}`]
        hover.tooltips = tooltipsOf(dimsOf(q), here, new Set([dim]), [value])
        hover.formatters = formattersOf(hover.tooltips)
      }
    }
    update(at)
    chart.show()
    return update
  }

  function formattersOf(tooltips) {
    const found = {}
    for (const [, text] of tooltips) {
      const hit = /^(@\{\w+\})\{%/.exec(text)
      if (hit) found[hit[1]] = "printf"
    }
    return found
  }

  function dimsOf(q) {
    return q.dims.filter((dim) => !axes.get(dim).of_curves)
  }

  // One number over two axes, in colours; for a list of designs, points over two of its columns.
  function drawMap(card, spec, at) {
    const Bokeh = window.Bokeh
    const q = quantities.get(spec.quantity)
    const [one, other] = [columns.get(spec.x), columns.get(spec.y)]
    const scattered = one.dim === other.dim
    const log = (column) => !scattered && !column.words && isLogarithmic(column.values)
    const [xLog, yLog] = [log(one), log(other)]
    const chart = plot(card, {
      x: heading(one, spec.x), y: heading(other, spec.y), xKey: spec.x, yKey: spec.y, xLog, yLog, height: 380,
    })
    // Where numbers go over more than a decade, most of a map would have one colour.
    const colours = { palette: viridis, low: 0.1, high: 1, nan_color: "#c8c8c8" }
    const decades = overDecades(q)
    const mapper = decades ? new Bokeh.LogColorMapper(colours) : new Bokeh.LinearColorMapper(colours)
    const source = new Bokeh.ColumnDataSource({ data: {} })
    const fill = { field: "v", transform: mapper }
    const common = { source, fill_color: fill, line_color: fill, line_width: 1 }
    const cells = scattered
      ? chart.figure.scatter({ field: "x" }, { field: "y" }, { ...common, size: 6 })
      : chart.figure.quad({ ...common, left: { field: "l" }, right: { field: "r" }, bottom: { field: "b" }, top: { field: "t" } })
    const mark = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } })
    chart.figure.scatter({ field: "x" }, { field: "y" }, {
      source: mark, marker: "cross", size: 16, line_color: "white", line_width: 5,
    })
    chart.figure.scatter({ field: "x" }, { field: "y" }, {
      source: mark, marker: "cross", size: 14, line_color: "black", line_width: 2,
    })
    const ticker = decades ? new Bokeh.FixedTicker({ ticks: [], minor_ticks: [] }) : new Bokeh.BasicTicker()
    const formatter = new Bokeh.BasicTickFormatter()
    const title = plain(heading(q, spec.quantity))
    const label = new Bokeh.ColorBar({ color_mapper: mapper, ticker, formatter, title, width: 14, padding: 4 })
    chart.figure.add_layout(label, "right")
    const hover = chart.hover([cells], [])
    const xs = scattered ? spread(placesOf(q, one.dim), MOST_POINTS) : spread(placesOf(q, one.dim), MOST_CELLS)
    const ys = scattered ? [0] : spread(placesOf(q, other.dim), MOST_CELLS)
    const [left, right] = scattered ? [[], []] : edges(xs.map((p) => coordinate(spec.x, p)), xLog)
    const [bottom, top] = scattered ? [[], []] : edges(ys.map((p) => coordinate(spec.y, p)), yLog)
    if (!scattered) {
      chart.figure.x_range = new Bokeh.Range1d({ start: Math.min(...left), end: Math.max(...right) })
      chart.figure.y_range = new Bokeh.Range1d({ start: Math.min(...bottom), end: Math.max(...top) })
    }
    const note = element("p", { class: "note" })
    card.append(note)
    const update = (now) => {
      const here = { ...now }
      const found = { x: [], y: [], l: [], r: [], b: [], t: [], v: [], s: [] }
      const [px, py] = [[], []]
      for (const [j, y] of ys.entries()) {
        for (const [i, x] of xs.entries()) {
          here[one.dim] = x
          if (!scattered) here[other.dim] = y
          const value = valueOf(q, here)
          px.push(x)
          py.push(scattered ? x : y)
          found.v.push(Number.isFinite(value) ? value : NaN)
          found.s.push(Number.isFinite(value) ? numberText(value) : statusAt(here) || "no value")
          found.l.push(left[i])
          found.r.push(right[i])
          found.b.push(bottom[j])
          found.t.push(top[j])
        }
      }
      found.x = px.map((p) => coordinate(spec.x, p))
      found.y = py.map((p) => coordinate(spec.y, p))
      let [low, high] = [Infinity, -Infinity]
      for (const v of found.v) if (v === v) { low = Math.min(low, v); high = Math.max(high, v) }
      if (!(low <= high)) [low, high] = [0.1, 1]
      mapper.low = low
      mapper.high = high > low ? high : low + (Math.abs(low) || 1) * 1e-6
      if (decades) ticker.ticks = roundNumbers(mapper.low, mapper.high)
      source.data = { ...found, ...columnsAlong(one.dim, px), ...(scattered ? {} : columnsAlong(other.dim, py)) }
      const value = [spec.quantity, `@{s} ${escapePlaceholders(q.unit)}`]
      hover.tooltips = tooltipsOf(dimsOf(q), now, new Set([one.dim, other.dim]), [value])
      hover.formatters = formattersOf(hover.tooltips)
      mark.data = spec.marked
        ? { x: [coordinate(spec.x, now[one.dim] ?? 0)], y: [coordinate(spec.y, now[other.dim] ?? 0)] }
        : { x: [], y: [] }
      const missing = found.v.filter((v) => v !== v).length
      note.textContent = missing ? `Grey: ${missing} of ${found.v.length} designs have no value.` : ""
    }
    update(at)
    chart.show()
    return update
  }

  // 1, 2, 5, 10 ... between two numbers; of many decades the powers of ten.
  function roundNumbers(low, high) {
    const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))]
    const found = []
    for (let power = first; power <= last; power += Math.max(1, Math.ceil((last - first) / 12))) {
      for (const digit of last - first > 3 ? [1] : [1, 2, 5]) found.push(Number(`${digit}e${power}`))
    }
    return found.filter((v) => v >= low && v <= high)
  }

  function overDecades(q) {
    let [low, high] = [Infinity, -Infinity]
    for (const v of q.data) {
      if (!Number.isFinite(v)) continue
      if (v <= 0) return false
      low = Math.min(low, v)
      high = Math.max(high, v)
    }
    return high / low > 20
  }

  // Edges of cells half-way between their points.
  function edges(values, log) {
    const v = log ? values.map(Math.log) : values
    const back = log ? Math.exp : (x) => x
    const half = (i) => (v[i + 1] - v[i]) / 2
    const only = Math.abs(v[0]) / 10 || 0.5
    const before = v.map((x, i) => back(v.length < 2 ? x - only : i > 0 ? x - half(i - 1) : x - half(0)))
    const after = v.map((x, i) => back(v.length < 2 ? x + only : i + 1 < v.length ? x + half(i) : x + half(i - 1)))
    return [before, after]
  }

  // Curves over the crank angle or the order: several quantities, or one at several designs.
  function drawCurves(card, spec, at) {
    const list = spec.quantities.map((name) => quantities.get(name))
    const x = spec.over
    const over = spec.lines ? spread(placesOf(list[0], spec.lines), MOST_LINES) : [null]
    const label = list.length === 1 ? heading(list[0], spec.quantities[0]) : list[0].unit ? `[${list[0].unit}]` : ""
    const xs = columns.get(x)
    const angle = x === "crank_angle"
    const chart = plot(card, { x: heading(xs, x.replace("_", " ")), y: label })
    if (angle && !xs.words && xs.values.length) {
      const last = xs.values[xs.values.length - 1]
      const begin = xs.values[0]
      // A cycle from 0 to 719 degrees is drawn to 720.
      const step = xs.values.length > 1 ? last - xs.values[xs.values.length - 2] : 0
      const end = Math.abs((last + step - begin) % 180) < 1e-6 ? last + step : last
      if (end - begin > 150) chart.figure.xaxis.ticker = new window.Bokeh.SingleIntervalTicker({ interval: end - begin > 400 ? 90 : 45 })
      chart.figure.x_range = new window.Bokeh.Range1d({ start: begin, end })
    }
    const series = []
    for (const [i, q] of list.entries()) {
      const places = placesOf(q, x)
      for (const [j, place] of over.entries()) {
        const colour = over.length > 1 ? colourOf(j, over.length) : COLOURS[i % COLOURS.length]
        const source = new window.Bokeh.ColumnDataSource({ data: {} })
        const many = list.length * over.length
        let renderers
        if (angle) {
          renderers = [chart.figure.line({ field: "x" }, { field: "v" }, { source, line_color: colour, line_width: 2 })]
        } else {
          renderers = [
            chart.figure.segment({ field: "x" }, 0, { field: "x" }, { field: "v" }, { source, line_color: colour, line_width: 2 }),
            chart.figure.scatter({ field: "x" }, { field: "v" }, { source, size: 7, fill_color: colour, line_color: colour }),
          ]
        }
        const hover = chart.hover(renderers.slice(-1), [])
        const entry = many > 1
          ? chart.entry(place === null ? spec.quantities[i] : nameAt(spec.lines, place), colour, renderers, i < MOST_LINES)
          : null
        if (entry && place === null) entry.title = q.title
        series.push({ q, i, j, place, source, hover, places, many, name: spec.quantities[i] })
      }
    }
    if (over.length > 1) card.append(element("p", { class: "note" }, `A line for each value of ${spec.lines}` + (over.length < axes.get(spec.lines).count ? `, ${over.length} of ${axes.get(spec.lines).count}.` : ".")))
    const note = element("p", { class: "note" })
    card.append(note)
    const update = (now) => {
      for (const { q, i, j, place, source, hover, places, many, name } of series) {
        const here = { ...now }
        if (place !== null) here[spec.lines] = place
        // Stems of several quantities stand beside their order, all in the same sequence.
        const shift = angle || many === 1 ? 0 : 0.08 * (i + j - (many - 1) / 2) * smallestStep(xs.values)
        const values = places.map((p) => ((here[x] = p), valueOf(q, here)))
        source.data = {
          x: places.map((p) => coordinate(x, p) + shift), v: values.map((v) => (Number.isFinite(v) ? v : NaN)),
          ...columnsAlong(x, places),
        }
        const value = [name, `@{v}{%.5g} ${escapePlaceholders(q.unit)}`]
        hover.tooltips = tooltipsOf(q.dims, nearestPlaces(q, here), new Set([x]), [value])
        hover.formatters = formattersOf(hover.tooltips)
      }
      note.textContent = elsewhere(list[0], now, spec.lines)
    }
    update(at)
    chart.show()
    return update
  }

  function smallestStep(values) {
    let step = Infinity
    for (let i = 1; i < values.length; i++) step = Math.min(step, Math.abs(values[i] - values[i - 1]))
    return Number.isFinite(step) ? step : 1
  }

  function nearestPlaces(q, at) {
    const found = { ...at }
    q.dims.forEach((dim, i) => {
      if (q.nearest[i]) found[dim] = q.at[dim][q.nearest[i][at[dim] ?? 0]]
    })
    return found
  }

  // What is said where a curve is that of a near design and not of the chosen one.
  function elsewhere(q, at, lines) {
    const real = nearestPlaces(q, at)
    const other = q.dims.filter((d) => !axes.get(d).of_curves && d !== lines && real[d] !== (at[d] ?? 0))
    if (!other.length) return ""
    return `Drawn at the nearest design in this page: ${other.map((d) => `${d} ${nameAt(d, real[d])}`).join(", ")}.`
  }

  // Two components of a force against each other, in scale; a loop for each value of an axis.
  // A component is a quantity, or a quantity and one of its directions.
  function drawPolar(card, spec, at) {
    const [right, up] = [spec.right, spec.up].map(([name, direction]) => {
      const q = quantities.get(name)
      return { q, direction, label: heading(q, direction === null ? name : `${name} along ${nameAt("direction", direction)}`) }
    })
    const q = right.q
    const over = spec.lines ? spread(placesOf(q, spec.lines), MOST_LINES) : [null]
    const chart = plot(card, { x: right.label, y: up.label, height: 420 })
    chart.figure.match_aspect = true
    const places = placesOf(q, "crank_angle")
    const closed = [...places, places[0]]
    const series = over.map((place, i) => {
      const source = new window.Bokeh.ColumnDataSource({ data: {} })
      const colour = over.length > 1 ? colourOf(i, over.length) : COLOURS[0]
      const line = chart.figure.line({ field: "x" }, { field: "y" }, { source, line_color: colour, line_width: 2 })
      if (over.length > 1) chart.entry(nameAt(spec.lines, place), colour, [line])
      return { place, source, hover: chart.hover([line], []) }
    })
    chart.figure.scatter([0], [0], { marker: "cross", size: 12, line_color: "#666" })
    const update = (now) => {
      for (const { place, source, hover } of series) {
        const here = place === null ? now : { ...now, [spec.lines]: place }
        const values = ({ q, direction }) => closed.map((p) => valueOf(q, { ...here, direction: direction ?? 0, crank_angle: p }))
        source.data = { x: values(right), y: values(up), ...columnsAlong("crank_angle", closed) }
        const told = [[right.label, "@{x}{%.5g}"], [up.label, "@{y}{%.5g}"]]
        const dims = q.dims.filter((d) => d !== "direction")
        hover.tooltips = tooltipsOf(dims, nearestPlaces(q, here), new Set(["crank_angle"]), told)
        hover.formatters = formattersOf(hover.tooltips)
      }
    }
    update(at)
    chart.show()
    return update
  }

  return { data, axes, columns, quantities, element, valueOf, statusAt, numberText, nameAt, textAt, short, longestNames: MOST_NAMES, mostLines: MOST_LINES, drawNumbers, drawMap, drawCurves, drawPolar }
})()
