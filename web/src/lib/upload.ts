/** Files of an upload as the API takes them. */

export interface UploadFile {
  name: string
  /** Base64. */
  content: string
}

/** Larger files are refused by the server anyway; these are not even read. */
const MAX_BYTES = 16 * 2 ** 20

/** A world, its keyframes and the sources of its plugins. */
const MAX_FILES = 18

/** Reads files into base64; throws with a sentence for a person. */
export async function filesForUpload(files: readonly File[]): Promise<UploadFile[]> {
  if (files.length > MAX_FILES)
    throw new Error(
      'Choose one file, the YAML file and the image of one ROS map, or one world and what says how things move in it.',
    )
  const large = files.find((file) => file.size > MAX_BYTES)
  if (large) throw new Error(`${large.name} is larger than 16 MiB.`)
  return Promise.all(files.map(async (file) => ({ name: file.name, content: await base64(file) })))
}

async function base64(file: File): Promise<string> {
  const bytes = new Uint8Array(await file.arrayBuffer())
  let text = ''
  // In pieces: a call takes only so many arguments.
  for (let at = 0; at < bytes.length; at += 8192)
    text += String.fromCharCode(...bytes.subarray(at, at + 8192))
  return btoa(text)
}
