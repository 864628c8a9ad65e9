// The program of a report: figures and the explorer. The page holds the numbers as base64 and Bokeh's
// figures without numbers (`data`, from charts.py); this takes out of the numbers what the sliders and
// selectors choose, and puts it into the sources of the figures. Texts of archives are put in as text,
// never as HTML.
"use strict"
;(() => {
  const data = JSON.parse(document.getElementById("data").textContent)
  const MOST_LINES = 8 // of one figure
  const MOST_POINTS = 20000 // of one series
  const MOST_CELLS = 150 // along a side of a map
  const MOST_WORDS = 40 // along an axis
  const coarse = matchMedia("(pointer: coarse)").matches
  const model = (type, values = {}) => new window.Bokeh.Models[type](values)

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
    const nearest = new Int32Array(count)
    let j = 0
    for (let i = 0; i < count; i++) {
      while (j + 1 < places.length && Math.abs(places[j + 1] - i) <= Math.abs(places[j] - i)) j++
      nearest[i] = j
    }
    return nearest
  }

  function valueOf(q, at) {
    let index = 0
    for (let i = 0; i < q.dims.length; i++) {
      const place = at[q.dims[i]] ?? 0
      index += (q.nearest[i] ? q.nearest[i][place] : place) * q.strides[i]
    }
    return q.data[index]
  }

  // Values at some places along a dimension; gaps where there is none.
  function valuesOf(q, at, dim, places) {
    const here = { ...at }
    return places.map((place) => {
      here[dim] = place
      const value = valueOf(q, here)
      return Number.isFinite(value) ? value : NaN
    })
  }

  // Some places along an axis at which a quantity has values of its own.
  function placesOf(q, dim, most = Infinity) {
    return spread(q.at[dim] ?? Array.from({ length: axes.get(dim).count }, (_, i) => i), most)
  }

  // Places along a dimension at which a quantity has any value.
  function filled(q, dim) {
    const axis = q.dims.indexOf(dim)
    const some = new Set()
    q.data.forEach((v, i) => Number.isFinite(v) && some.add(Math.floor(i / q.strides[axis]) % q.shape[axis]))
    const places = placesOf(q, dim)
    return some.size ? places.filter((_, i) => some.has(i)) : places
  }

  function spread(places, most) {
    if (places.length <= most) return places
    return Array.from({ length: most }, (_, i) => places[Math.round((i * (places.length - 1)) / (most - 1))])
  }

  function spanOf(values) {
    let [low, high] = [Infinity, -Infinity]
    for (const v of values) if (Number.isFinite(v)) [low, high] = [Math.min(low, v), Math.max(high, v)]
    return [low, high]
  }

  // Some significant digits; `last` is the power of ten of a digit that must be there: that with
  // which omega_max and omega_min differ.
  function numberText(value, last) {
    if (value === null || Number.isNaN(value)) return "no value"
    if (!Number.isFinite(value)) return value > 0 ? "infinite" : "-infinite"
    const size = Math.abs(value)
    if (value === 0 || (size >= 1e-3 && size < 1e7)) {
      const first = value === 0 ? 0 : Math.floor(Math.log10(size))
      const digits = Math.max(size >= 1e4 ? 6 : 5, first - (last ?? first) + 1)
      return String(Number(value.toPrecision(Math.min(digits, 15))))
    }
    return value.toExponential(3)
  }

  function textAt(key, place) {
    const column = columns.get(key)
    if (column.words) return column.words[place]
    if (key === "misfire" && !column.values[place]) return "none"
    return `${numberText(column.values[place])} ${column.unit}`.trim()
  }

  // What a place along an axis is called: the name of a design, or a number with its unit.
  const nameAt = (dim, place) => textAt(axes.get(dim).named_by ?? dim, place)
  const coordinate = (key, place) => (columns.get(key).words ? place : columns.get(key).values[place])
  const heading = (item, name) => (item.unit ? `${name} [${item.unit}]`.trim() : name)

  function statusAt(at) {
    const q = quantities.get("status")
    return q ? data.outcomes[valueOf(q, at)] ?? "" : ""
  }

  // The places whose values are drawn, where a quantity has fewer of them than the sliders.
  function nearestPlaces(q, at) {
    const real = { ...at }
    q.dims.forEach((dim, i) => {
      if (q.nearest[i]) real[dim] = q.at[dim][q.nearest[i][at[dim] ?? 0]]
    })
    return real
  }

  function elsewhere(q, at, lines) {
    const real = nearestPlaces(q, at)
    const other = q.dims.filter((d) => !axes.get(d).of_curves && d !== lines && real[d] !== (at[d] ?? 0))
    if (!other.length) return ""
    return `Drawn at the nearest design in this page: ${other.map((d) => `${d} ${nameAt(d, real[d])}`).join(", ")}.`
  }

  // ---- the page ---------------------------------------------------------------------------------

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag)
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value)
    made.append(...children)
    return made
  }

  function card(parent, title, note) {
    const made = element("figure", { class: "card", "data-title": title }, element("h3", {}, title))
    if (note) made.append(element("p", { class: "note" }, note))
    parent.append(made)
    return made
  }

  const short = (text, most) => (text.length > most ? text.slice(0, most - 1) + "…" : text)

  // BokehJS would set mathematics between these signs, and fetch a library for it.
  const plain = (text) => String(text).replace(/\$\$/g, "$\u200b$").replace(/\\([[(\])])/g, "\\\u200b$1")

  // In tooltips, BokehJS replaces what follows these signs.
  const literal = (text) => String(text).replace(/[@$]/g, (sign) => (sign === "@" ? "＠" : "＄"))

  // One of Bokeh's figures in a card, and the parts of it that are named in charts.py.
  async function chartIn(parent, kind) {
    const place = element("div", { class: "plot" })
    const note = element("p", { class: "note" })
    parent.append(place, note)
    const views = await window.Bokeh.embed.embed_item(data.charts[kind], place)
    const figure = views.roots[0].model
    const named = Object.fromEntries(data.named[kind].map((name) => [name, figure.document.get_model_by_name(name)]))
    // A finger scrolls the page; who wants to zoom chooses a tool first.
    if (coarse) figure.toolbar.active_drag = null
    return { ...named, figure, place, note, height: figure.height }
  }

  // What stands along one direction of a figure: numbers, logarithms or names.
  function setAxis(chart, side, label, { key = "", log = false, interval = 0, span = null } = {}) {
    const axis = chart[side]
    const names = columns.get(key)?.words ?? []
    const places = spread(names.map((_, i) => i), MOST_WORDS)
    axis.axis_label = plain(label)
    axis.major_label_overrides = new Map(places.map((i) => [i, plain(short(names[i], 26))]))
    const range = span ? model("Range1d", { start: span[0], end: span[1] }) : model("DataRange1d")
    if (places.length) axis.ticker = model("FixedTicker", { ticks: places, minor_ticks: [] })
    else if (log) logarithmicTicks(axis, range)
    else axis.ticker = interval ? model("SingleIntervalTicker", { interval }) : model("BasicTicker")
    chart.figure[`${side}_range`] = range
    chart.figure[`${side}_scale`] = model(log ? "LogScale" : "LinearScale")
  }

  // BokehJS has even steps up to two decades, which leaves the lower one without a number.
  function logarithmicTicks(axis, range) {
    const few = model("FixedTicker", { ticks: [], minor_ticks: [] })
    const even = model("LogTicker")
    const choose = () => {
      const wide = range.start > 0 && range.end / range.start > 8 && Number.isFinite(range.end)
      if (wide) few.ticks = roundNumbers(range.start, range.end)
      axis.ticker = wide ? few : even
    }
    range.change.connect(choose)
    choose()
  }

  function isLogarithmic(key) {
    const { words, values, dim } = columns.get(key)
    if (words || axes.get(dim).list || values.length < 4 || !(spanOf(values)[0] > 0)) return false
    if (values[values.length - 1] / values[0] < 8) return false
    return values.every((v, i) => i === 0 || Math.abs(v / values[i - 1] / (values[1] / values[0]) - 1) < 0.02)
  }

  // An axis and its columns of designs; designs with names need no number.
  function keysOf(dim) {
    const axis = axes.get(dim)
    const own = axis.list && axis.named_by ? [] : [dim]
    return [...new Set([...(axis.named_by ? [axis.named_by] : []), ...own, ...axis.columns])].slice(0, 12)
  }

  const columnName = (key) => `k${[...columns.keys()].indexOf(key)}`

  // Columns of a source that hold the axes' values at some places along one dimension.
  function columnsAlong(dim, places) {
    return Object.fromEntries(keysOf(dim).map((key) => [columnName(key), places.map((p) => columns.get(key).values[p])]))
  }

  // Tooltips: values of axes that vary out of the source's columns, of the others as text.
  function setTooltips(hover, dims, at, varying, first) {
    const rows = [...first]
    for (const dim of [...dims].sort((a, b) => varying.includes(b) - varying.includes(a))) {
      for (const key of keysOf(dim)) {
        const { words, unit } = columns.get(key)
        if (!varying.includes(dim)) rows.push([key, literal(textAt(key, at[dim] ?? 0))])
        else rows.push([key, words ? `@{${columnName(key)}}` : `@{${columnName(key)}}{%.5g} ${literal(unit)}`])
      }
    }
    const numbers = rows.map(([, text]) => /^(@\{\w+\})\{%/.exec(text)?.[1]).filter(Boolean)
    hover.formatters = Object.fromEntries(numbers.map((name) => [name, "printf"]))
    hover.tooltips = rows
  }

  // ---- kinds of figures -------------------------------------------------------------------------
  // Each prepares a figure for a specification, and returns what fills it at places of the axes.

  // Series over an axis, a column of designs, the crank angle or the order: several quantities, or one
  // with a line for each value of another axis. With `up`, one component of a force over the other.
  function lines(chart, spec) {
    const { figure } = chart
    const list = spec.quantities.map((name) => quantities.get(name))
    const [first] = list
    const { dim, words, values: along } = columns.get(spec.x)
    const axis = axes.get(dim)
    const own = placesOf(first, dim, MOST_POINTS)
    const places = spec.up ? [...own, own[0]] : own
    const apart = spec.lines ? filled(first, spec.lines) : [null]
    const joins = spec.lines === "misfire" // misfires of different cylinders are often alike
    const over = joins ? apart : spread(apart, MOST_LINES)
    const series = list.flatMap((q) => over.map((place) => ({ q, place })))
    const many = series.length > 1
    const points = !axis.joined
    const stems = dim === "order"
    const upright = words && !axis.of_curves // names are legible beside a figure, not below it
    const shown = points || (!axis.of_curves && places.length <= 80)
    const label = ([name, direction]) => heading(quantities.get(name), direction === null ? name : `${name} along ${nameAt("direction", direction)}`)
    const y = spec.up ? label(spec.up) : heading(first, spec.label ?? (list.length === 1 ? first.name : ""))
    const x = spec.up ? label(spec.right) : heading(columns.get(spec.x), axis.list && spec.x === dim ? "design" : spec.x.replace("crank_angle", "crank angle"))
    chart.height = upright ? Math.min(1200, 150 + 19 * Math.min(places.length, 60)) : spec.up ? 420 : 330
    if (upright) {
      setAxis(chart, "x", y)
      setAxis(chart, "y", "", { key: spec.x, span: [places.length - 0.5, -0.5] })
    } else {
      setAxis(chart, "x", x, spec.up ? {} : { key: spec.x, log: isLogarithmic(spec.x), ...(dim === "crank_angle" ? cycleOf(along) : {}) })
      setAxis(chart, "y", y)
    }
    figure.match_aspect = chart.across.visible = chart.up.visible = Boolean(spec.up)
    for (let i = figure.renderers.length / 2; i < series.length; i++) {
      const data_source = model("ColumnDataSource")
      const both = figure.renderers.slice(0, 2).map(({ glyph }) => model("GlyphRenderer", { data_source, glyph: model(glyph.type, glyph.attributes) }))
      figure.renderers = [...figure.renderers, ...both]
    }
    const told = [] // renderers that tell their values
    figure.renderers.forEach((renderer) => (renderer.visible = false))
    const colourOf = (i, count) => (over.length > 1 ? data.colours[Math.round((0.85 * 255 * i) / Math.max(count - 1, 1))] : data.series[i % data.series.length])
    const names = series.map(({ q, place }) => plain(place === null ? q.name : nameAt(spec.lines, place)))
    const items = series.map((_, i) => {
      const [line, scatter] = figure.renderers.slice(2 * i, 2 * i + 2)
      const name = names[i]
      const colour = colourOf(i, series.length)
      const hollow = points && list.length > 1 && !stems && i > 0
      const size = stems ? 7 : !points ? 5 : (places.length > 500 ? 4 : 9) + (hollow ? 5 : 0)
      line.glyph.line_color = colour
      scatter.glyph.setv({ size, line_color: colour, fill_color: colour, fill_alpha: hollow ? 0 : 0.85, marker: hollow ? "diamond" : "circle" })
      const renderers = [...(points && !stems ? [] : [line]), ...(shown ? [scatter] : [])]
      for (const renderer of renderers) renderer.setv({ name, visible: i < MOST_LINES })
      told.push(renderers[renderers.length - 1])
      return model("LegendItem", { label: { value: short(name, 40) }, renderers })
    })
    // As many columns of the legend as fit.
    const setLegend = (shownItems) => {
      const lengths = shownItems.map((item) => 7 * item.label.value.length + 40)
      const widthOf = (n) => [...Array(n).keys()].reduce((sum, k) => sum + Math.max(...lengths.filter((_, i) => i % n === k)), 0)
      let across = shownItems.length
      while (across > 1 && widthOf(across) > chart.place.clientWidth - 50) across--
      chart.legend.ncols = across
      chart.legend.items = many ? shownItems : []
      figure.height = chart.height + (many ? 28 * Math.ceil(shownItems.length / across) : 0)
    }
    setLegend(items)
    // One line, with the names of all, stands for those that lie on each other.
    const joinEqual = (drawn) => {
      const every = equalLines(names, drawn)
      const groups = every.slice(0, MOST_LINES)
      for (const item of items) for (const renderer of item.renderers) renderer.visible = false
      groups.forEach(([i, name], rank) => {
        const [line, scatter] = figure.renderers.slice(2 * i, 2 * i + 2)
        const colour = colourOf(rank, groups.length)
        line.glyph.line_color = colour
        scatter.glyph.setv({ line_color: colour, fill_color: colour })
        items[i].label = { value: short(name, 40) }
        for (const renderer of items[i].renderers) renderer.setv({ name, visible: true })
      })
      setLegend(groups.map(([i]) => items[i]))
      return groups.length < every.length ? `${groups.length} of ${every.length} lines are drawn.` : ""
    }
    chart.hover.renderers = told
    const notes = [
      over.length > 1 ? `A ${points ? "colour" : "line"} for each value of ${spec.lines}${over.length < apart.length ? `, ${over.length} of ${apart.length}` : ""}${joins ? "; equal ones are one" : ""}.` : "",
      !axis.of_curves && places.length < axis.count ? `${places.length} of ${axis.count} points are drawn.` : "",
    ]
    const step = stems ? Math.min(1, ...along.slice(1).map((v, i) => Math.abs(v - along[i]))) : 0
    return (at) => {
      const drawn = series.map(({ q, place }, i) => {
        const here = place === null ? at : { ...at, [spec.lines]: place }
        const component = ([name, direction]) => valuesOf(quantities.get(name), { ...here, direction: direction ?? 0 }, dim, places)
        const values = spec.up ? component(spec.up) : valuesOf(q, here, dim, places)
        // Stems of several series stand beside their order, all in the same sequence.
        const shift = 0.08 * (i - (series.length - 1) / 2) * step
        const across = spec.up ? component(spec.right) : places.map((p) => coordinate(spec.x, p) + shift)
        const [x, y] = upright ? [values, across] : [across, values]
        figure.renderers[2 * i].data_source.data = { x, y, ...columnsAlong(dim, places) }
        return values
      })
      const left = joins ? joinEqual(drawn) : ""
      const unit = literal(first.unit)
      const values = spec.up ? [[x, "@{x}{%.5g}"], [y, "@{y}{%.5g}"]] : [[many && !spec.lines ? "value" : first.name, `@{${upright ? "x" : "y"}}{%.5g} ${unit}`]]
      if (many) values.unshift([spec.lines ?? "quantity", "$name"])
      const dims = first.dims.filter((d) => d !== spec.lines && (d === dim || !axes.get(d).of_curves) && !(spec.up && d === "direction"))
      setTooltips(chart.hover, dims, nearestPlaces(first, at), [dim], values)
      chart.note.textContent = [...notes, left, axis.of_curves ? elsewhere(first, at, spec.lines) : ""].filter(Boolean).join(" ")
    }
  }

  // The first of lines that lie on each other within their width, and the names of all, as in
  // sweeps/view/figures/wording.py.
  function equalLines(names, lines) {
    const [low, high] = spanOf(lines.flatMap((line) => [...line].filter(Number.isFinite)))
    if (!(low <= high)) return names.map((name, i) => [i, name])
    const width = 2e-3 * Math.min(1, (high - low) / (Math.max(Math.abs(low), Math.abs(high)) || 1))
    const near = (a, b) => a === b || (a !== a && b !== b) || Math.abs(a - b) <= width * Math.abs(b)
    const first = lines.map((one) => lines.findIndex((other) => [...other].every((v, k) => near(one[k], v))))
    return [...new Set(first)].sort((a, b) => a - b).map((i) => {
      const group = first.flatMap((place, k) => (place === i ? [k] : []))
      const run = /\d$/.test(names[i]) && group.length > 2 && group[group.length - 1] - i === group.length - 1
      const last = names[group[group.length - 1]]
      return [i, run ? `${names[i]} to ${last}` : group.map((k) => names[k]).join(", ")]
    })
  }

  // A cycle from 0 to 719 degrees is drawn to 720, with ticks that divide it.
  function cycleOf(angles) {
    if (angles.length < 2) return {}
    const [begin, last] = [angles[0], angles[angles.length - 1]]
    const next = 2 * last - angles[angles.length - 2]
    const end = Math.abs((next - begin) % 180) < 1e-6 ? next : last
    return { span: [begin, end], interval: end - begin > 400 ? 90 : end - begin > 150 ? 45 : 0 }
  }

  // One number over two axes, in colours; for a list of designs, points over two of its columns.
  function map(chart, spec) {
    const { figure } = chart
    const q = quantities.get(spec.quantities[0])
    const [one, other] = [columns.get(spec.x).dim, columns.get(spec.y).dim]
    const scattered = one === other
    const xs = placesOf(q, one, scattered ? MOST_POINTS : MOST_CELLS)
    const ys = scattered ? [null] : placesOf(q, other, MOST_CELLS)
    const sides = [[spec.x, xs, "x"], [spec.y, ys, "y"]].map(([key, places, side]) => {
      const label = heading(columns.get(key), key)
      if (scattered) return setAxis(chart, side, label, { key })
      const log = isLogarithmic(key)
      setAxis(chart, side, label, { key, log })
      return edges(places.map((p) => coordinate(key, p)), log, axes.get(columns.get(key).dim).joined)
    })
    // Where numbers go over more than a decade, most of a map would have one colour.
    const [least, most] = spanOf(q.data)
    const log = least > 0 && most / least > 20
    const mapper = model(log ? "LogColorMapper" : "LinearColorMapper", { palette: data.colours, low: 0.1, high: 1, nan_color: data.missing })
    const ticker = log ? model("FixedTicker", { ticks: [], minor_ticks: [] }) : model("BasicTicker")
    const bar = model("ColorBar", { color_mapper: mapper, ticker, formatter: model("BasicTickFormatter"), title: plain(heading(q, q.name)), width: 14, padding: 4 })
    const [quads, points] = figure.renderers
    quads.visible = !scattered
    points.visible = scattered
    const pairs = ys.flatMap((y, j) => xs.map((x, i) => ({ x, y: scattered ? x : y, i, j })))
    return (at) => {
      const places = pairs.map(({ x, y }) => (scattered ? { ...at, [one]: x } : { ...at, [one]: x, [other]: y }))
      const value = places.map((here) => valueOf(q, here)).map((v) => (Number.isFinite(v) ? v : NaN))
      const told = value.map((v, i) => (v === v ? numberText(v) : statusAt(places[i]) || "no value"))
      let [low, high] = spanOf(value)
      if (!(low <= high)) [low, high] = [0.1, 1]
      mapper.setv({ low, high: high > low ? high : low + (Math.abs(low) || 1) * 1e-6 })
      if (log) ticker.ticks = roundNumbers(mapper.low, mapper.high)
      if (figure.right[0] !== bar) {
        // Not before the range is known: a bar that is drawn first keeps another one.
        figure.right = [bar]
        for (const { glyph } of [quads, points]) glyph.fill_color = glyph.line_color = { field: "value", transform: mapper }
      }
      const cells = scattered ? {} : {
        left: pairs.map((p) => sides[0][0][p.i]), right: pairs.map((p) => sides[0][1][p.i]),
        bottom: pairs.map((p) => sides[1][0][p.j]), top: pairs.map((p) => sides[1][1][p.j]),
        ...columnsAlong(other, pairs.map((p) => p.y)),
      }
      quads.data_source.data = {
        value, told, x: pairs.map((p) => coordinate(spec.x, p.x)), y: pairs.map((p) => coordinate(spec.y, p.y)),
        ...cells, ...columnsAlong(one, pairs.map((p) => p.x)),
      }
      const dims = q.dims.filter((d) => !axes.get(d).of_curves)
      setTooltips(chart.hover, dims, at, [one, other], [[q.name, `@{told} ${literal(q.unit)}`]])
      const mark = (key, dim) => (spec.marked ? [coordinate(key, at[dim] ?? 0)] : [])
      figure.renderers[2].data_source.data = { x: mark(spec.x, one), y: mark(spec.y, other) }
      const missing = value.filter((v) => v !== v).length
      chart.note.textContent = missing ? `Grey: ${missing} of ${value.length} designs have no value.` : ""
    }
  }

  // 1, 2, 5, 10 ... between two numbers; of many decades the powers of ten.
  function roundNumbers(low, high) {
    const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))]
    const numbers = []
    for (let power = first; power <= last; power += Math.max(1, Math.ceil((last - first) / 12))) {
      for (const digit of last - first > 3 ? [1] : [1, 2, 5]) numbers.push(Number(`${digit}e${power}`))
    }
    return numbers.filter((v) => v >= low && v <= high)
  }

  // Edges of cells half-way between their points, and no farther than these on a joined axis.
  function edges(values, log, joined) {
    const rising = [...new Set(values.filter(Number.isFinite))].sort((a, b) => a - b)
    const inner = rising.slice(1).map((v, i) => (log ? Math.sqrt(v * rising[i]) : (v + rising[i]) / 2))
    let [first, last] = [rising[0], rising[rising.length - 1]]
    const only = Math.abs(first) / 10 || 0.5
    if (!inner.length) [first, last] = [first - only, last + only]
    else if (!joined) [first, last] = [[first, inner[0]], [last, inner[inner.length - 1]]].map(([end, middle]) => (log ? end ** 2 / middle : 2 * end - middle))
    const middles = [first, ...inner, last]
    const places = values.map((v) => rising.indexOf(v))
    return [places.map((i) => middles[i] ?? NaN), places.map((i) => middles[i + 1])]
  }

  const KINDS = { lines, stems: lines, map }

  // ---- figures and explorer ---------------------------------------------------------------------

  async function figure(parent, spec) {
    const cut = spec.cut.map((dim) => `${axes.get(dim).list ? "design" : dim} ${nameAt(dim, data.start[dim])}`)
    const decides = spec.cut.some((dim) => data.decides.includes(dim)) ? ", where the verdict is decided" : ""
    const chart = await chartIn(card(parent, spec.title, cut.length ? `At ${cut.join(", ")}${decides}.` : ""), spec.kind)
    KINDS[spec.kind](chart, spec)(data.start)
  }

  // A card with selectors. Each option of them says a part of what is drawn.
  async function view(parent, { title, kind, choices }, at, drawn) {
    const made = card(parent, title)
    const selects = choices.map(({ label, options, chosen }) => {
      const select = element("select", {}, ...options.map(([text], i) => element("option", { value: i }, short(text, 60))))
      select.value = chosen
      return element("label", {}, `${label} `, select)
    })
    made.append(element("div", { class: "choices" }, ...selects))
    const refused = element("p", { class: "note" })
    made.append(refused)
    const chart = await chartIn(made, kind)
    let update = () => {}
    const again = () => {
      const spec = Object.assign({ marked: true }, ...choices.map(({ options }, i) => options[selects[i].lastChild.value][1]))
      const { dims, name } = quantities.get(spec.quantities[0])
      const dim = columns.get(spec.x).dim
      const strange = [spec.x, spec.y].find((key) => key && !dims.includes(columns.get(key).dim))
      const useless = spec.lines && !dims.includes(spec.lines)
      const same = spec.x === spec.y
      refused.textContent = strange || useless ? `${name} does not depend on ${strange ?? spec.lines}.` : same ? "Choose two different axes." : ""
      chart.place.hidden = chart.note.hidden = Boolean(strange || same)
      if (useless || spec.lines === dim) spec.lines = null
      update = strange || same ? () => {} : KINDS[kind](chart, spec)
      update(at)
    }
    for (const select of selects) select.addEventListener("change", again)
    again()
    drawn.push((now) => update(now))
  }

  function explorer() {
    const at = { ...data.start }
    const drawn = [] // functions that draw again
    const controls = element("div", { class: "controls" })
    const views = element("div", { class: "cards" })
    document.getElementById("explorer").append(controls, views)
    let waiting = false
    const changed = () => {
      if (waiting) return
      waiting = true
      requestAnimationFrame(() => {
        waiting = false
        for (const update of drawn) update(at)
      })
    }
    for (const [dim, axis] of axes) {
      if (!axis.of_curves && axis.count > 1) controls.append(control(dim, axis, at, changed))
    }
    if (!controls.childElementCount) controls.remove()
    const single = [...quantities.values()].filter((q) => q.name !== "status" && !q.dims.some((d) => axes.get(d).of_curves))
    if (single.length) drawn.push(table(card(views, "Numbers of this design"), single, at))
    return data.views.map((spec) => view(views, spec, at, drawn))
  }

  // A slider, or a selector for words.
  function control(dim, axis, at, changed) {
    const id = `axis-${[...axes.keys()].indexOf(dim)}`
    const label = element("label", { for: id }, axis.list ? "design" : dim)
    label.title = columns.get(dim).title
    const told = element("output", { for: id })
    const chosen = axis.named_by && axis.count <= 200
    const input = chosen
      ? element("select", { id }, ...Array.from({ length: axis.count }, (_, i) => element("option", { value: i }, short(nameAt(dim, i), 60))))
      : element("input", { id, type: "range", min: 0, max: axis.count - 1, step: 1 })
    input.value = at[dim]
    const tell = () => {
      const own = axis.list && !axis.named_by ? `number ${textAt(dim, at[dim])}` : chosen ? "" : nameAt(dim, at[dim])
      const others = axis.columns.filter((key) => key !== axis.named_by).slice(0, 12).map((key) => `${key} ${textAt(key, at[dim])}`)
      told.textContent = [own, ...others].filter(Boolean).join(", ")
    }
    input.addEventListener(chosen ? "change" : "input", () => {
      at[dim] = Number(input.value)
      tell()
      changed()
    })
    tell()
    return element("div", { class: "control" }, label, input, told)
  }

  function table(made, single, at) {
    const cells = single.map(() => element("td", { class: "number" }))
    const rows = single.map((q, i) => element("tr", {}, element("td", {}, q.name), cells[i], element("td", { class: "unit" }, q.unit), element("td", { class: "about" }, q.title)))
    const outcome = element("p", { class: "note" })
    made.append(outcome, element("div", { class: "scroll low" }, element("table", {}, element("tbody", {}, ...rows))))
    const update = (now) => {
      single.forEach((q, i) => (cells[i].textContent = numberText(valueOf(q, now), q.last)))
      outcome.textContent = statusAt(now) && `Outcome: ${statusAt(now)}.`
    }
    update(at)
    return update
  }

  window.Bokeh.set_log_level("warn")
  const parent = document.getElementById("figures")
  // A figure of the verdict has its numbers in it.
  async function complete({ title, note, chart }) {
    const made = card(parent, title, note)
    const place = element("div", { class: "plot" })
    made.append(place)
    const views = await window.Bokeh.embed.embed_item(chart, place)
    if (coarse) views.roots[0].model.toolbar.active_drag = null
  }
  const verdicts = data.made.map(complete)
  const figures = data.figures.map((spec) => figure(parent, spec))
  Promise.all([...verdicts, ...figures, ...explorer()])
})()
