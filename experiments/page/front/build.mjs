// Bundles src/ into built/, which is committed: nobody needs node to make a report.
//
//   npm ci && npm run build
//
// Each bundle names the digest of what it was built from, and of itself; tests/report/test_bundle.py checks both.
import { createHash } from 'node:crypto'
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from 'node:fs'
import { build } from 'esbuild'

const SOURCES = ['build.mjs', 'package.json', 'package-lock.json', ...readdirSync('src').sort().map((name) => `src/${name}`)]
const BUNDLES = ['page', 'sheet']

const sha256 = (data) => createHash('sha256').update(data).digest('hex')
const sources = sha256(SOURCES.map((name) => `${sha256(readFileSync(name))}  ${name}\n`).join(''))
const licence = readFileSync('node_modules/three/LICENSE', 'utf8').trim()
const { version } = JSON.parse(readFileSync('node_modules/three/package.json', 'utf8'))

mkdirSync('built', { recursive: true })
for (const name of BUNDLES) {
  const result = await build({
    entryPoints: [`src/${name}.js`],
    bundle: true,
    minify: true,
    format: 'iife',
    target: 'es2020',
    legalComments: 'none',
    write: false,
  })
  // The text of the licence travels with every copy, into the report too; "</" would end the script that holds it.
  const code = result.outputFiles[0].text.replaceAll('</script', '<\\/script')
  const parts = [`Built from src/ by build.mjs.`, `sources sha256: ${sources}`, `code sha256: ${sha256(code)}`]
  if (code.includes('WebGLRenderer')) parts.push(`Holds parts of three.js ${version}:`, '', licence)
  writeFileSync(`built/${name}.js`, `/*!\n${parts.join('\n')}\n*/\n${code}`)
}
writeFileSync('built/THREE-LICENSE.txt', `three.js ${version}, parts of which are in sheet.js:\n\n${licence}\n`)
