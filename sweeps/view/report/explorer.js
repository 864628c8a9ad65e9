// The figures of a report, and its explorer: sliders, selectors and what they redraw.
"use strict"
;(() => {
  const { data, axes, columns, quantities, element, valueOf, statusAt, numberText, nameAt, textAt, short, drawNumbers, drawMap, drawCurves, drawPolar } = report
  const MOST_NAMES = report.longestNames
  const MOST_LINES = report.mostLines
  const KINDS = { numbers: drawNumbers, map: drawMap, curves: drawCurves, polar: drawPolar }

  // ---- figures ----------------------------------------------------------------------------------

  function card(parent, title, note) {
    const made = element("figure", { class: "card", "data-title": title }, element("h3", {}, title))
    if (note) made.append(element("p", { class: "note" }, note))
    parent.append(made)
    return made
  }

  function figures() {
    const parent = document.getElementById("figures")
    for (const spec of data.figures) {
      const cut = spec.cut.map((dim) => `${axes.get(dim).list ? "design" : dim} ${nameAt(dim, spec.at[dim])}`)
      const note = cut.length ? `At ${cut.join(", ")}.` : ""
      KINDS[spec.kind](card(parent, spec.title, note), spec, spec.at)
    }
  }

  // ---- explorer ---------------------------------------------------------------------------------

  function explorer() {
    const parent = document.getElementById("explorer")
    const at = {}
    const drawn = [] // functions that draw again
    const controls = element("div", { class: "controls" })
    const views = element("div", { class: "cards" })
    parent.append(controls, views)
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
      at[dim] = data.start?.[dim] ?? 0
      if (axis.of_curves || axis.count < 2) continue
      controls.append(control(dim, axis, at, changed))
    }
    if (!controls.childElementCount) controls.remove()
    const list = [...quantities.values()].filter((q) => q.name !== "status")
    const numbers = list.filter((q) => !q.dims.some((d) => axes.get(d).of_curves))
    const varied = numbers.filter((q) => q.dims.some((d) => axes.get(d).count > 1))
    const curves = (over) => list.filter((q) => q.dims.includes(over) && axes.get(over).count > 1)
    if (numbers.length) drawn.push(table(card(views, "Numbers of this design"), numbers, at))
    if (varied.length) numbersView(views, varied, at, drawn)
    mapView(views, varied, at, drawn)
    for (const over of ["crank_angle", "order"]) {
      if (axes.has(over)) curveViews(views, curves(over), over, at, drawn)
    }
    if (data.paths.length) pathView(views, at, drawn)
  }

  // A slider, or a selector for words.
  function control(dim, axis, at, changed) {
    const id = `axis-${[...axes.keys()].indexOf(dim)}`
    const label = element("label", { for: id }, axis.list ? "design" : dim)
    label.title = columns.get(dim).title
    const box = element("div", { class: "control" }, label)
    const told = element("output", { for: id })
    if (axis.named_by && axis.count <= 200) {
      const select = element("select", { id })
      for (let i = 0; i < axis.count; i++) select.append(element("option", { value: i }, short(nameAt(dim, i), 60)))
      select.value = String(at[dim])
      select.addEventListener("change", () => ((at[dim] = Number(select.value)), tell(), changed()))
      box.append(select)
    } else {
      const slider = element("input", { id, type: "range", min: 0, max: axis.count - 1, step: 1, value: at[dim] })
      slider.addEventListener("input", () => ((at[dim] = Number(slider.value)), tell(), changed()))
      box.append(slider)
    }
    const tell = () => {
      const own = axis.list && !axis.named_by ? `number ${textAt(dim, at[dim])}` : axis.named_by && axis.count <= 200 ? "" : nameAt(dim, at[dim])
      const others = axis.columns.filter((key) => key !== axis.named_by).slice(0, 12).map((key) => `${key} ${textAt(key, at[dim])}`)
      told.textContent = [own, ...others].filter(Boolean).join(", ")
    }
    tell()
    box.append(told)
    return box
  }

  function choice(label, options, value) {
    const select = element("select")
    for (const option of options) {
      const [own, text] = Array.isArray(option) ? option : [option, option]
      select.append(element("option", { value: own }, short(text, 60)))
    }
    if (value !== undefined) select.value = value
    return { select, box: element("label", {}, `${label} `, select) }
  }

  // A card with selectors, drawn anew when one of them changes, and updated when an axis does.
  function redrawn(made, choices, at, drawn, draw) {
    made.append(element("div", { class: "choices" }, ...choices.map((c) => c.box)))
    const place = element("div")
    made.append(place)
    let update = null
    const again = () => {
      for (const plot of place.querySelectorAll(".plot")) plot.forget?.()
      place.replaceChildren()
      update = draw(place, choices.map((c) => c.select.value)) ?? null
    }
    for (const c of choices) c.select.addEventListener("change", again)
    again()
    drawn.push((now) => update?.(now))
  }

  function table(made, numbers, at) {
    const rows = numbers.map((q) => {
      const value = element("td", { class: "number" })
      return { q, value, row: element("tr", {}, element("td", {}, q.name), value, element("td", { class: "unit" }, q.unit), element("td", { class: "about" }, q.title)) }
    })
    const outcome = element("p", { class: "note" })
    made.append(outcome, element("div", { class: "scroll low" }, element("table", {}, element("tbody", {}, ...rows.map((r) => r.row)))))
    const update = (now) => {
      for (const { q, value } of rows) value.textContent = numberText(valueOf(q, now))
      const told = statusAt(now)
      outcome.textContent = told ? `Outcome: ${told}.` : ""
    }
    update(at)
    return update
  }

  // Names that the horizontal axis of a chart may have for a quantity.
  function alongOf(q) {
    const found = []
    for (const dim of q.dims) {
      const axis = axes.get(dim)
      if (axis.of_curves || axis.count < 2) continue
      if (!axis.list || axis.count > MOST_NAMES || !axis.named_by || axis.named_by === dim) found.push(dim)
      for (const key of axis.columns) {
        const column = columns.get(key)
        if (column.words ? column.words.length <= MOST_NAMES : true) found.push(key)
      }
    }
    return found
  }

  function longest(q) {
    const dims = q.dims.filter((d) => !axes.get(d).of_curves && axes.get(d).count > 1 && axes.get(d).of_designs)
    const numeric = dims.filter((d) => !columns.get(d).words)
    return (numeric.length ? numeric : dims).sort((a, b) => axes.get(b).count - axes.get(a).count)
  }

  // Axes for whose values lines are drawn beside each other: first a few with names.
  function compared(q) {
    const dims = q.dims.filter((d) => !axes.get(d).of_curves && axes.get(d).count > 1)
    const named = dims.filter((d) => axes.get(d).named_by && axes.get(d).count <= MOST_LINES)
    return [...new Set([...named, ...longest(q).filter((d) => !axes.get(d).list)])]
  }

  // What charts of a quantity begin with: axes, of a list of designs its columns of numbers.
  function firstKeys(q) {
    const numbersOf = (dim) => axes.get(dim).columns.filter((key) => !columns.get(key).words)
    const wanted = longest(q).flatMap((dim) => {
      const axis = axes.get(dim)
      if (!axis.list) return [dim]
      return [...(axis.named_by && axis.count <= MOST_NAMES ? [axis.named_by] : []), ...numbersOf(dim), dim]
    })
    return [...new Set([...wanted, ...alongOf(q)])]
  }

  function numbersView(views, varied, at, drawn) {
    const made = card(views, "Numbers over an axis")
    const quantity = choice("quantity", varied.map((q) => q.name), preferred(varied))
    const every = [...new Set(varied.flatMap(alongOf))]
    const first = quantities.get(quantity.select.value)
    const wanted = firstKeys(first).find((key) => every.includes(key))
    const over = choice("over", every, wanted)
    const others = [...new Set(varied.flatMap((q) => q.dims))].filter((d) => axes.get(d).count > 1 && (!axes.get(d).list || axes.get(d).named_by))
    const lines = choice("a line for each", [["", "no other axis"], ...others], compared(first).find((d) => d !== columns.get(over.select.value).dim) ?? "")
    redrawn(made, [quantity, over, lines], at, drawn, (place, [name, x, each]) => {
      const q = quantities.get(name)
      if (!q.dims.includes(columns.get(x).dim)) {
        place.append(element("p", { class: "note" }, `${name} does not depend on ${x}.`))
        return null
      }
      const useful = each && q.dims.includes(each) && each !== columns.get(x).dim
      return drawNumbers(place, { quantities: [name], x, lines: useful ? each : null }, at)
    })
  }

  // What the figures above begin with: it varies.
  function preferred(list) {
    const wanted = [...data.figures.flatMap((f) => f.quantities ?? [f.quantity]), "delta"]
    return wanted.find((name) => list.some((q) => q.name === name)) ?? list[0].name
  }

  function mapView(views, varied, at, drawn) {
    const maps = varied.filter((q) => alongOf(q).filter((key) => !columns.get(key).words || !axes.get(columns.get(key).dim).list).length >= 2)
    if (!maps.length) return
    const made = card(views, "Map over two axes")
    const quantity = choice("quantity", maps.map((q) => q.name), preferred(maps))
    const first = quantities.get(quantity.select.value)
    const keys = [...new Set(maps.flatMap(alongOf))].filter((key) => !columns.get(key).words || !axes.get(columns.get(key).dim).list)
    const start = firstKeys(first).filter((key) => keys.includes(key))
    const across = choice("across", keys, start[0])
    const up = choice("up", keys, start[1] ?? keys[1])
    redrawn(made, [quantity, across, up], at, drawn, (place, [name, x, y]) => {
      const q = quantities.get(name)
      const wrong = [x, y].find((key) => !q.dims.includes(columns.get(key).dim))
      if (wrong || x === y) {
        place.append(element("p", { class: "note" }, wrong ? `${name} does not depend on ${wrong}.` : "Choose two different axes."))
        return null
      }
      return drawMap(place, { quantity: name, x, y, marked: true }, at)
    })
  }

  function curveViews(views, curves, over, at, drawn) {
    if (!curves.length) return
    const word = over === "crank_angle" ? "crank angle" : "order"
    const groups = new Map()
    for (const q of curves) groups.set(q.unit, [...(groups.get(q.unit) ?? []), q.name])
    const named = [...groups].map(([unit, names]) => [unit, `${names.length > 1 ? `all ${names.length}` : names[0]}${unit ? ` in ${unit}` : ""}`])
    const titled = over === "crank_angle" ? "Curves of this design" : "Orders of this design"
    const made = card(views, titled)
    const start = groups.has("N m") ? "N m" : curves[0].unit
    const group = choice("quantities", named, start)
    redrawn(made, [group], at, drawn, (place, [unit]) => drawCurves(place, { quantities: groups.get(unit), over }, at))
    const others = [...new Set(curves.flatMap((q) => q.dims))].filter((d) => !axes.get(d).of_curves && axes.get(d).count > 1)
    if (!others.length) return
    const wide = card(views, `One quantity over the ${word}, several designs`)
    const wanted = curves.find((q) => q.name === "omega") ?? curves[0]
    const quantity = choice("quantity", curves.map((q) => q.name), wanted.name)
    const each = choice("a line for each", others, compared(wanted)[0] ?? others[0])
    redrawn(wide, [quantity, each], at, drawn, (place, [name, lines]) => {
      const useful = quantities.get(name).dims.includes(lines)
      if (!useful) place.append(element("p", { class: "note" }, `${name} does not depend on ${lines}.`))
      return drawCurves(place, { quantities: [name], over, lines: useful ? lines : null }, at)
    })
  }

  function pathView(views, at, drawn) {
    const made = card(views, "Path of a force over the cycle")
    const path = choice("path", data.paths.map((p, i) => [String(i), p.title]))
    const dims = [...new Set(data.paths.flatMap((p) => quantities.get(p.right[0]).dims))]
    const others = dims.filter((d) => !axes.get(d).of_curves && d !== "direction" && axes.get(d).count > 1)
    const each = choice("a line for each", [["", "no other axis"], ...others])
    redrawn(made, [path, each], at, drawn, (place, [number, lines]) => {
      const chosen = data.paths[Number(number)]
      const useful = quantities.get(chosen.right[0]).dims.includes(lines)
      return drawPolar(place, { ...chosen, lines: useful ? lines : null }, at)
    })
  }

  window.Bokeh.set_log_level("warn")
  figures()
  explorer()
})()
