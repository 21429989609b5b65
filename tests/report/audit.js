// Run in the page by test_browser.py: contrast of every text with what it stands on, after WCAG 2.2, criterion 1.4.3.
;(() => {
  // Whatever way a colour is written, a canvas says what it is.
  const pen = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true })
  const parsed = new Map()
  const parse = (text) => {
    if (!parsed.has(text)) {
      pen.clearRect(0, 0, 1, 1)
      pen.fillStyle = text
      pen.fillRect(0, 0, 1, 1)
      const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data
      parsed.set(text, [r, g, b, a / 255])
    }
    return parsed.get(text)
  }
  const over = (top, below) => [0, 1, 2].map((i) => top[i] * top[3] + below[i] * (1 - top[3]))
  const luminance = (colour) => {
    const [r, g, b] = colour.slice(0, 3).map((value) => {
      const part = value / 255
      return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4
    })
    return 0.2126 * r + 0.7152 * g + 0.0722 * b
  }
  const behind = (element) => {
    const layers = []
    for (let at = element; at; at = at.parentElement) {
      const colour = parse(getComputedStyle(at).backgroundColor)
      layers.push(colour)
      if (colour[3] === 1) break
    }
    return layers.reverse().reduce((below, top) => over(top, below), [255, 255, 255])
  }
  const visible = (element) => {
    const box = element.getBoundingClientRect()
    return box.width > 1 && box.height > 1 && getComputedStyle(element).visibility !== 'hidden'
  }
  window.contrasts = () => {
    const found = new Map()
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT)
    let count = 0
    for (let node = walk.nextNode(); node; node = walk.nextNode()) {
      const element = node.parentElement
      if (!node.data.trim() || element.closest('script, noscript, svg') || !visible(element)) continue
      count += 1
      const style = getComputedStyle(element)
      const ground = behind(element)
      const ink = over(parse(style.color), ground)
      const [light, dark] = [luminance(ink), luminance(ground)].sort((a, b) => b - a)
      const ratio = (light + 0.05) / (dark + 0.05)
      const size = parseFloat(style.fontSize)
      const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700)
      if (ratio < (large ? 3 : 4.5)) found.set(`${style.color} on ${ground}`, `${ratio.toFixed(2)}: ${node.data.trim().slice(0, 40)}`)
    }
    return { count, failures: [...found.entries()] }
  }
  // What the Tab key should reach, in the order of the document.
  window.stops = () =>
    [...document.querySelectorAll('a[href], button, input, summary, canvas[tabindex], [role="group"][tabindex]')].filter(
      (element) =>
        (visible(element) || element.className === 'skip') &&
        !(element.type === 'radio' && !element.checked) &&
        element.checkVisibility(),
    )
  // What is focused, its place among the stops, and whether a reader sees that it is.
  window.focused = () => {
    const element = document.activeElement
    const shown = element.type === 'radio' ? element.parentElement.querySelector('span, img') : element
    const marks = [element, shown, element.parentElement.querySelector('input ~ img')].filter(Boolean)
    const outlined = marks.some((mark) => {
      const style = getComputedStyle(mark)
      return style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2
    })
    return { place: window.stops().indexOf(element), outlined, what: element.outerHTML.slice(0, 80) }
  }
})()
