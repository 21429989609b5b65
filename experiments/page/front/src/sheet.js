// The sheet in the page: its slider, its lights, its colours, and how it is turned, by pointer and by keyboard.

import { readRecording } from './recording.js'
import { ABOVE, FIRST, View } from './view.js'

const STEP_RAD = Math.PI / 24
const FALL_MS = 4000
const stage = document.getElementById('stage')
const canvas = document.getElementById('view')
const slider = document.getElementById('way')
const calm = matchMedia('(prefers-reduced-motion: reduce)')

function start() {
  let view
  try {
    view = new View(canvas, readRecording(document.getElementById('recording').textContent))
  } catch (error) {
    stage.classList.add('without')
    document.getElementById('no-view').hidden = false
    return
  }
  followSlider(view)
  followLights(view)
  followColours(view)
  followTurning(view)
  followInk(view)
}

function followSlider(view) {
  const said = document.getElementById('where')
  const play = document.getElementById('fall')
  let running = 0

  const show = () => {
    const way = Number(slider.value) / Number(slider.max)
    const { step, time_s: time, height_mm: height } = view.setWay(way)
    const text = `step ${step}, after ${(1000 * time).toFixed(1)} ms; highest point ${height.toFixed(1)} mm above the bed`
    said.textContent = text
    slider.setAttribute('aria-valuetext', text)
    play.textContent = way < 1 ? 'Let it fall' : 'Start again'
    view.draw()
  }
  const stop = () => {
    cancelAnimationFrame(running)
    running = 0
  }
  play.addEventListener('click', () => {
    if (running) return stop()
    const from = Number(slider.value) < Number(slider.max) ? Number(slider.value) : 0
    // Who asked for less motion gets the two ends.
    if (calm.matches) {
      slider.value = from === 0 && slider.value === slider.max ? '0' : slider.max
      return show()
    }
    const began = performance.now()
    const tick = (now) => {
      const way = from + ((now - began) / FALL_MS) * Number(slider.max)
      slider.value = String(Math.min(way, Number(slider.max)))
      show()
      running = way < Number(slider.max) ? requestAnimationFrame(tick) : 0
    }
    running = requestAnimationFrame(tick)
  })
  slider.addEventListener('input', () => {
    stop()
    show()
  })
  show()
}

function followLights(view) {
  const lights = document.querySelectorAll('input[name="light"]')
  const show = async (light) => {
    const image = light.closest('label').querySelector('img')
    await image.decode()
    if (!light.checked) return
    view.setPicture(image)
    canvas.dataset.light = light.value
    view.draw()
  }
  for (const light of lights) {
    light.addEventListener('change', () => show(light))
    if (light.checked) show(light)
  }
}

function followColours(view) {
  const legend = document.getElementById('scale')
  for (const choice of document.querySelectorAll('input[name="shown"]')) {
    const show = () => {
      const error = choice.value === 'error'
      view.showError(error)
      legend.hidden = !error
      view.draw()
    }
    choice.addEventListener('change', show)
    if (choice.checked) show()
  }
}

function followTurning(view) {
  const turns = {
    ArrowLeft: () => view.turnBy(-STEP_RAD, 0),
    ArrowRight: () => view.turnBy(STEP_RAD, 0),
    ArrowUp: () => view.turnBy(0, STEP_RAD),
    ArrowDown: () => view.turnBy(0, -STEP_RAD),
    '+': () => view.turnBy(0, 0, 1.2),
    '-': () => view.turnBy(0, 0, 1 / 1.2),
    t: () => view.turnTo(ABOVE),
    r: () => view.turnTo(FIRST),
  }
  const turn = (key) => {
    turns[key]()
    view.draw()
  }
  canvas.addEventListener('keydown', (event) => {
    const key = event.key === '=' ? '+' : event.key
    if (!(key in turns) || event.ctrlKey || event.metaKey || event.altKey) return
    event.preventDefault()
    turn(key)
  })
  for (const button of document.querySelectorAll('button[data-turn]')) {
    button.addEventListener('click', () => turn(button.dataset.turn))
  }
  // Across it turns; up and down tilts by mouse, while a finger goes on scrolling the page.
  canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId))
  canvas.addEventListener('pointermove', (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return
    const tilt = event.pointerType === 'touch' ? 0 : event.movementY * 0.006
    view.turnBy(-event.movementX * 0.006, tilt)
    view.draw()
  })
}

function followInk(view) {
  const root = document.documentElement
  const set = () => {
    const style = getComputedStyle(canvas)
    view.setInk(style.getPropertyValue('--ink-soft').trim(), style.getPropertyValue('--rule').trim())
    view.draw()
  }
  root.addEventListener('themechange', set)
  set()
}

if (stage) {
  // Made when the reader comes near: the page is there before it.
  const watch = new IntersectionObserver(
    (entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return
      watch.disconnect()
      start()
    },
    { rootMargin: '600px 0px' },
  )
  watch.observe(stage)
}
