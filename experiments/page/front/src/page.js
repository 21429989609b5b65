// What the page does besides the sheet: the choice of light or dark, the contents, where the reader is.

const root = document.documentElement
const THEMES = ['auto', 'light', 'dark']
const KEY = 'deskew-report-theme'

root.classList.add('js')

function kept() {
  // A browser may refuse storage to a file: then the choice lasts as long as the page.
  try {
    return localStorage.getItem(KEY)
  } catch {
    return null
  }
}

function setTheme(theme) {
  root.dataset.theme = theme
  try {
    localStorage.setItem(KEY, theme)
  } catch {
    // As above.
  }
}

root.dataset.theme = THEMES.includes(kept()) ? kept() : 'auto'

function followTheme() {
  const buttons = document.querySelectorAll('input[name="theme"]')
  for (const button of buttons) {
    button.checked = button.value === root.dataset.theme
    button.addEventListener('change', () => {
      setTheme(button.value)
      root.dispatchEvent(new Event('themechange'))
    })
  }
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => root.dispatchEvent(new Event('themechange')))
}

function followContents() {
  const menu = document.querySelector('.contents details')
  const wide = matchMedia('(min-width: 68rem)')
  const fit = () => menu.toggleAttribute('open', wide.matches)
  fit()
  wide.addEventListener('change', fit)
  menu.addEventListener('click', (event) => {
    if (event.target.closest('a') && !wide.matches) menu.open = false
  })
  menu.addEventListener('keydown', (event) => {
    if (event.key === 'Escape' && !wide.matches) {
      menu.open = false
      menu.querySelector('summary').focus()
    }
  })
}

function followReading() {
  const links = new Map([...document.querySelectorAll('.contents a')].map((link) => [link.hash.slice(1), link]))
  const seen = new Set()
  const watch = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) seen[isIntersecting ? 'add' : 'delete'](target.id)
      const current = [...links.keys()].find((id) => seen.has(id))
      for (const [id, link] of links) {
        if (id === current) link.setAttribute('aria-current', 'true')
        else link.removeAttribute('aria-current')
      }
    },
    { rootMargin: '-20% 0px -70% 0px' },
  )
  for (const id of links.keys()) watch.observe(document.getElementById(id))
}

// A link into a folded part opens it.
function openTarget() {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)))
  for (let part = target; part; part = part.parentElement) if (part.matches?.('details')) part.open = true
}

document.addEventListener('DOMContentLoaded', () => {
  followTheme()
  followContents()
  followReading()
  openTarget()
})
addEventListener('hashchange', openTarget)
